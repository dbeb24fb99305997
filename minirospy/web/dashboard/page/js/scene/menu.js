// The menu of an interactive marker, at the mouse. Its titles come from the server: they are text.

import { fill, h } from "../dom.js";
import { t } from "../texts.js";

export class Menu {
  constructor(frame) {
    this.frame = frame;
    this.element = h("div", {
      class: "marker-menu",
      role: "menu",
      hidden: true,
      onkeydown: (event) => this.key(event),
    });
    this.outside = (event) => {
      if (!this.element.contains(event.target)) this.close();
    };
    frame.append(this.element);
  }

  /** Show entries at a place of the picture; `choose(entry)` is called with that which is chosen. */
  open(x, y, entries, choose) {
    this.choose = choose;
    fill(this.element, this.rows(entries));
    this.element.hidden = false;
    const { clientWidth, clientHeight } = this.frame;
    this.element.style.left = `${Math.max(0, Math.min(x, clientWidth - this.element.offsetWidth))}px`;
    this.element.style.top = `${Math.max(0, Math.min(y, clientHeight - this.element.offsetHeight))}px`;
    this.buttons()[0]?.focus({ preventScroll: true });
    document.addEventListener("pointerdown", this.outside, true);
  }

  close() {
    this.element.hidden = true;
    document.removeEventListener("pointerdown", this.outside, true);
  }

  remove() {
    this.close();
    this.element.remove();
  }

  rows(entries) {
    return entries.map((entry) => {
      const { title, isChecked, children, command } = entry;
      const isParent = children.length > 0;
      const below = isParent ? h("div", { class: "submenu", hidden: true }) : null;
      const button = h(
        "button",
        {
          type: "button",
          role: isChecked === null ? "menuitem" : "menuitemcheckbox",
          "aria-checked": isChecked === null ? null : String(isChecked),
          "aria-expanded": isParent ? "false" : null,
          disabled: Boolean(command) && !isParent,
          title: command ? t("A page starts no programs: {command}", { command }) : null,
          onclick: () => (isParent ? this.unfold(button, below, children) : this.chosen(entry)),
        },
        h("span", {}, isChecked === null ? "" : isChecked ? "☑" : "☐"),
        h("span", {}, title),
        h("span", {}, isParent ? "▸" : ""),
      );
      return [button, below];
    });
  }

  unfold(button, below, children) {
    if (!below.firstChild) fill(below, this.rows(children));
    below.hidden = !below.hidden;
    button.setAttribute("aria-expanded", String(!below.hidden));
  }

  chosen(entry) {
    this.close();
    this.choose(entry);
  }

  buttons() {
    return [...this.element.querySelectorAll("button:not([disabled])")].filter((each) => each.offsetParent);
  }

  key(event) {
    if (event.key === "Escape") this.close();
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const found = this.buttons();
    found.at((found.indexOf(document.activeElement) + step) % found.length)?.focus();
  }
}
