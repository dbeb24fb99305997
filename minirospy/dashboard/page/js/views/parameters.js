// Parameters: all that are set, live; set and deleted.

import { h, quoted, setText } from "../dom.js";
import { t } from "../texts.js";

export class Parameters {
  constructor(link, words, main, place) {
    this.link = link;
    this.rows = new Map();
    this.filter = h("input", { type: "search", placeholder: "Filter names and values", "aria-label": "Filter", value: words.get("filter") ?? "", oninput: () => {
      this.showFiltered();
      place.remember({ filter: this.filter.value });
    } });
    this.count = h("span", { class: "muted" });
    this.list = h("div", { class: "topics", role: "list", "aria-label": "Parameters" });
    this.name = h("input", { placeholder: "/name", "aria-label": "Name of a new parameter", autocomplete: "off" });
    this.value = h("input", { placeholder: "value, as 5 or [1, 2] or text", "aria-label": "Its value", class: "grow", autocomplete: "off" });
    main.append(h("div", { class: "bar" }, this.filter, this.count), this.list,
      h("form", { class: "bar", onsubmit: (event) => { event.preventDefault(); this.add(); } }, this.name, this.value, h("button", { type: "submit" }, "Set")));
    this.ending = link.watch(["parameters"], () => this.update());
  }

  close() {
    this.ending();
  }

  update() {
    const names = [...this.link.parameters.keys()].sort();
    for (const [name, row] of this.rows) {
      if (!this.link.parameters.has(name)) {
        row.element.remove();
        this.rows.delete(name);
      }
    }
    let before = null;
    for (const name of names) {
      let row = this.rows.get(name);
      if (!row) {
        row = this.makeRow(name);
        this.rows.set(name, row);
      }
      const text = quoted(this.link.parameters.get(name));
      // What a person is typing stays.
      if (row.text !== text && document.activeElement !== row.input) row.input.value = text;
      row.text = text;
      const next = before ? before.nextSibling : this.list.firstChild;
      if (row.element !== next) this.list.insertBefore(row.element, next);
      before = row.element;
    }
    this.showFiltered();
  }

  makeRow(name) {
    const input = h("input", { "aria-label": t("Value of {name}", { name }), autocomplete: "off" });
    const row = { input, text: "" };
    const element = h("form", { class: "row parameter", role: "listitem", onsubmit: (event) => {
      event.preventDefault();
      input.blur();
      this.link.setParameter(name, parsed(input.value));
    } }, h("span", { class: "name" }, name), input,
    h("button", { type: "button", class: "small", title: t("Delete {name}", { name }), onclick: () => this.link.setParameter(name, undefined) }, t("delete")));
    input.addEventListener("blur", () => { if (!input.value.trim()) input.value = row.text; });
    row.element = element;
    element.dataset.name = name;
    return row;
  }

  showFiltered() {
    const words = this.filter.value.toLowerCase();
    let count = 0;
    for (const [name, row] of this.rows) {
      row.element.hidden = !`${name} ${row.text}`.toLowerCase().includes(words);
      count += !row.element.hidden;
    }
    setText(this.count, t("{count} of {all} parameters", { count, all: this.rows.size }));
  }

  add() {
    const name = this.name.value.trim();
    if (!name) return;
    this.link.setParameter(name.startsWith("/") ? name : `/${name}`, parsed(this.value.value));
    this.name.value = this.value.value = "";
  }
}

/** Return a value as rosparam reads it in the usual cases: JSON, else text. */
function parsed(text) {
  try {
    return JSON.parse(text) ?? text;
  } catch {
    return text;
  }
}
