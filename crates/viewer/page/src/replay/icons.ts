// Signs on buttons: drawn, since not every font has them.

const SHAPES = {
  play: "M7 4.5v15l12-7.5z",
  pause: "M6.5 5h4v14h-4zM13.5 5h4v14h-4z",
  back: "M15 5v14L7 12zM5 5h2v14H5z",
  forward: "M9 5v14l8-7zM17 5h2v14h-2z",
  start: "M19 5v14l-7-7zM12 5v14l-7-7zM3 5h2v14H3z",
  end: "M5 5v14l7-7zM12 5v14l7-7zM19 5h2v14h-2z",
} as const;

export type Icon = keyof typeof SHAPES;

export function icon(name: Icon): SVGSVGElement {
  const made = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  made.setAttribute("viewBox", "0 0 24 24");
  made.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", SHAPES[name]);
  made.append(path);
  return made;
}
