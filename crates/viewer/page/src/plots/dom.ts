// Elements in one call each.

type Tags = HTMLElementTagNameMap;

type Properties<K extends keyof Tags> = Partial<Omit<Tags[K], "style" | "attributes">> & {
  /** Attributes that are no properties, such as aria-label. */
  attributes?: Record<string, string>;
};

/** A new element with these properties and children; texts become text nodes. */
export function make<K extends keyof Tags>(
  tag: K, properties: Properties<K> = {}, ...children: (Node | string)[]
): Tags[K] {
  const element = document.createElement(tag);
  const { attributes, ...others } = properties;
  Object.assign(element, others);
  for (const [name, value] of Object.entries(attributes ?? {})) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** A choice among a few, as a select. */
export function choice<T extends string | number>(
  label: string, options: { value: T; text: string }[], chosen: T, onChange: (value: T) => void,
): HTMLSelectElement {
  const select = make("select", { attributes: { "aria-label": label } });
  for (const { value, text } of options) select.append(make("option", { value: String(value), textContent: text }));
  select.value = String(chosen);
  select.addEventListener("change", () => {
    const found = options[select.selectedIndex];
    if (found) onChange(found.value);
  });
  return select;
}

export function button(text: string, title: string, onClick: () => void): HTMLButtonElement {
  const made = make("button", { type: "button", textContent: text, title });
  made.addEventListener("click", onClick);
  return made;
}
