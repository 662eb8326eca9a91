// The panel's tabs: arrow keys go from one to the next, as in any list of tabs.
import "./tabs.css";
import { make } from "../dom.ts";

export interface Tab {
  name: string;
  panel: HTMLElement;
}

export interface Tabs {
  /** Shows this tab's panel. */
  open(panel: HTMLElement): void;
  /** Whether this tab can be had at all. */
  offer(panel: HTMLElement, offered: boolean): void;
}

/** Each panel hears "tabshown" when it comes to sight. */
export function createTabs(element: HTMLElement, tabs: readonly Tab[]): Tabs {
  const buttons = tabs.map(({ name, panel }) => {
    panel.setAttribute("role", "tabpanel");
    const attributes = { type: "button", role: "tab", id: `tab-${panel.id}`, "aria-controls": panel.id };
    return make("button", attributes, name);
  });
  element.append(...buttons);
  const open = (panel: HTMLElement) => {
    tabs.forEach((tab, index) => {
      const chosen = tab.panel === panel;
      tab.panel.hidden = !chosen;
      buttons[index]!.setAttribute("aria-selected", String(chosen));
      buttons[index]!.tabIndex = chosen ? 0 : -1;
    });
    panel.dispatchEvent(new Event("tabshown"));
  };
  const step = (from: number, by: number) => {
    const offered = buttons.filter((button) => !button.hidden);
    const at = offered.indexOf(buttons[from]!);
    const to = buttons.indexOf(offered[(at + by + offered.length) % offered.length]!);
    buttons[to]!.focus();
    open(tabs[to]!.panel);
  };
  buttons.forEach((button, index) => {
    button.addEventListener("click", () => open(tabs[index]!.panel));
    button.addEventListener("keydown", ({ key }) => {
      if (key === "ArrowRight") step(index, 1);
      if (key === "ArrowLeft") step(index, -1);
    });
  });
  open(tabs[0]!.panel);
  return {
    open,
    offer: (panel, offered) => {
      const index = tabs.findIndex((tab) => tab.panel === panel);
      buttons[index]!.hidden = !offered;
      if (!offered && !panel.hidden) open(tabs[0]!.panel);
    },
  };
}
