// Small help for making elements.
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K, className = "", text = "",
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text) element.textContent = text;
  return element;
}

/** A checkbox with its words. */
export function makeCheckbox(text: string, checked: boolean, onChange: (checked: boolean) => void): HTMLLabelElement {
  const label = make("label", "view-check");
  const box = make("input");
  box.type = "checkbox";
  box.checked = checked;
  box.addEventListener("change", () => onChange(box.checked));
  label.append(box, text);
  return label;
}

export function makeButton(text: string, onClick: () => void): HTMLButtonElement {
  const button = make("button", "", text);
  button.type = "button";
  button.addEventListener("click", onClick);
  return button;
}
