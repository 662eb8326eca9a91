// The page's colours for what is drawn by WebGL: read from the style sheet's variables.
import { Color } from "three";

export interface Colours {
  dark: boolean;
  surface: Color;
  text: Color;
  muted: Color;
  line: Color;
  accent: Color;
  good: Color;
  bad: Color;
  warning: Color;
  users: Color[];
}

/** For a page whose style sheet says nothing. */
const FALLBACK = {
  surface: "#f7f8fa", text: "#1b2430", muted: "#5b6675", line: "#d3d9e1", accent: "#1f5fbf", good: "#1d7a46",
  bad: "#b3261e", warning: "#945b00",
};
const USERS = ["#1f6fd1", "#d1580f", "#2b8a3e", "#9c36b5", "#0b7f8c", "#c2255c", "#5f3dc4", "#7a6a00"];

export function readColours(): Colours {
  const style = getComputedStyle(document.documentElement);
  const read = (name: string, fallback: string) => new Color(style.getPropertyValue(`--${name}`).trim() || fallback);
  const named = (name: keyof typeof FALLBACK) => read(name, FALLBACK[name]);
  const surface = named("surface");
  return {
    dark: surface.getHSL({ h: 0, s: 0, l: 0 }).l < 0.4,
    surface,
    text: named("text"),
    muted: named("muted"),
    line: named("line"),
    accent: named("accent"),
    good: named("good"),
    bad: named("bad"),
    warning: named("warning"),
    users: USERS.map((fallback, user) => read(`user-${user}`, fallback)),
  };
}

/** How much of white (above 0) or black (below) the fingers of one user have besides its colour, in turn. */
const FINGER_SHADES = [0, 0.5, -0.4, 0.25];

/** Of one of a user's fingers: shades of the user's colour, so that they can be told apart. */
export function fingerColour(colours: Colours, user: number, finger: number): Color {
  const shade = FINGER_SHADES[finger % FINGER_SHADES.length] ?? 0;
  return userColour(colours, user).clone().lerp(new Color(shade > 0 ? "white" : "black"), Math.abs(shade));
}

export function userColour(colours: Colours, user: number): Color {
  return colours.users[user % colours.users.length] ?? colours.accent;
}
