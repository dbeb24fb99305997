// The folders of a list of names: their rows, which a person folds and unfolds, between the rows of the names.

import { h, setText } from "./dom.js";
import { arranged } from "./namespaces.js";
import { t } from "./texts.js";

export class Folders {
  /**
   * rowOf(name) returns the element of a name's row; show(element, label, depth) shows its label. wrap(button) returns
   * the element of a folder's row. changed() is called when a person folds or unfolds.
   */
  constructor(list, { rowOf, show, wrap, changed }) {
    this.list = list;
    this.rowOf = rowOf;
    this.show = show;
    this.wrap = wrap;
    this.changed = changed;
    this.toggled = new Map();
    this.headers = new Map(); // path -> {element, button, name, count}
  }

  /** Put the rows in order; return the names that are in folders that are folded. */
  arrange(names, { needed = new Set(), isFiltered = false, isFlat = false } = {}) {
    const rows = arranged(names, {
      toggled: this.toggled,
      needed,
      isAllOpen: isFiltered,
      ...(isFlat ? { maxFlat: Infinity } : {}),
    });
    const folded = new Set(names);
    const used = new Set();
    let before = null;
    for (const row of rows) {
      let element;
      if (row.kind === "name") {
        folded.delete(row.name);
        element = this.rowOf(row.name);
        this.show(element, row.label, row.depth);
      } else {
        used.add(row.path);
        element = this.showHeader(row);
      }
      const next = before ? before.nextSibling : this.list.firstChild;
      if (element !== next) this.list.insertBefore(element, next);
      before = element;
    }
    for (const [path, { element }] of this.headers) {
      if (used.has(path)) continue;
      element.remove();
      this.headers.delete(path);
    }
    return folded;
  }

  showHeader({ path, label, depth, count, isOpen }) {
    let header = this.headers.get(path);
    if (!header) {
      const name = h("span", { class: "name" });
      const number = h("span", { class: "muted" });
      const button = h("button", { type: "button", class: "folder", onclick: () => this.toggle(path) }, name, number);
      header = { element: this.wrap(button), button, name, number };
      header.element.dataset.folder = path;
      this.headers.set(path, header);
    }
    setText(header.name, label);
    setText(header.number, t("{count} inside", { count }));
    header.button.title = path;
    header.button.setAttribute("aria-expanded", String(isOpen));
    header.element.style.setProperty("--depth", String(depth));
    return header.element;
  }

  toggle(path) {
    const isOpen = this.headers.get(path).button.getAttribute("aria-expanded") === "true";
    this.toggled.set(path, !isOpen);
    this.changed();
  }
}
