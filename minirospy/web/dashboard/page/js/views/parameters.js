// Parameters: all that are set, live; set and deleted.

import { h, quoted, setText } from "../dom.js";
import { Folders } from "../folders.js";
import { t } from "../texts.js";

const PREVIEW_MS = 150; // without another key

export class Parameters {
  constructor(link, words, main, place) {
    this.link = link;
    this.rows = new Map();
    this.filter = h("input", {
      type: "search",
      placeholder: "Filter names and values",
      "aria-label": "Filter",
      value: words.get("filter") ?? "",
      oninput: () => {
        this.showFiltered();
        place.remember({ filter: this.filter.value });
      },
    });
    this.count = h("span", { class: "muted" });
    this.list = h("div", { class: "topics", role: "group", "aria-label": "Parameters" });
    this.folders = new Folders(this.list, {
      rowOf: (name) => this.rows.get(name).element,
      show: (element, label, depth) => {
        const name = element.querySelector(".name");
        setText(name, label);
        name.title = element.dataset.name;
        element.style.setProperty("--depth", String(depth));
      },
      wrap: (button) => h("div", { class: "row folder-row" }, button),
      changed: () => this.showFiltered(),
    });
    this.name = h("input", { placeholder: "/name", "aria-label": "Name of a new parameter", autocomplete: "off" });
    this.value = h("input", {
      placeholder: "value, as 5 or [1, 2] or text",
      "aria-label": "Its value",
      class: "grow",
      autocomplete: "off",
      oninput: () => this.preview(this.value, this.typed),
    });
    this.typed = h("span", { class: "muted preview-type", "aria-live": "polite" }); // what becomes of the text
    main.append(
      h("div", { class: "bar" }, this.filter, this.count),
      this.list,
      h(
        "form",
        {
          class: "bar",
          onsubmit: (event) => {
            event.preventDefault();
            this.add();
          },
        },
        this.name,
        this.value,
        this.typed,
        h("button", { type: "submit" }, "Set"),
      ),
    );
    this.ending = link.watch(["parameters"], () => this.update());
  }

  close() {
    clearTimeout(this.timer);
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
    for (const name of names) {
      let row = this.rows.get(name);
      if (!row) {
        row = this.makeRow(name);
        this.rows.set(name, row);
      }
      const text = textOf(this.link.parameters.get(name), this.link.parameterTypes.get(name));
      // What a person is typing stays.
      if (row.text !== text && document.activeElement !== row.input) row.input.value = text;
      row.text = text;
    }
    this.showFiltered();
  }

  makeRow(name) {
    const typed = h("span", { class: "muted preview-type", "aria-live": "polite" });
    const input = h("input", {
      "aria-label": t("Value of {name}", { name }),
      autocomplete: "off",
      oninput: () => this.preview(input, typed),
    });
    const row = { input, text: "" };
    const element = h(
      "form",
      {
        class: "row parameter",
        onsubmit: (event) => {
          event.preventDefault();
          // What was not changed stays as it is: doubles in lists of other values look like ints.
          const text = input.value;
          input.blur();
          if (text !== row.text) this.set(name, text, typed);
        },
      },
      h("span", { class: "name" }, name),
      h("span", { class: "with-type" }, input, typed),
      h(
        "button",
        {
          type: "button",
          class: "small",
          title: t("Delete {name}", { name }),
          onclick: () => this.link.setParameter(name, undefined),
        },
        t("delete"),
      ),
    );
    input.addEventListener("blur", () => {
      say(typed, "");
      if (!input.value.trim()) input.value = row.text;
    });
    row.element = element;
    element.dataset.name = name;
    return row;
  }

  showFiltered() {
    const words = this.filter.value.toLowerCase();
    const found = [...this.rows.keys()]
      .filter((name) => `${name} ${this.rows.get(name).text}`.toLowerCase().includes(words))
      .sort();
    const shown = new Set(found);
    // What a person is typing in stays.
    const typing = [...this.rows].filter(([, { input }]) => input === document.activeElement).map(([name]) => name);
    const folded = this.folders.arrange(found, { needed: new Set(typing), isFiltered: Boolean(words) });
    for (const [name, { element }] of this.rows) element.hidden = !shown.has(name) || folded.has(name);
    setText(this.count, t("{count} of {all} parameters", { count: found.length, all: this.rows.size }));
  }

  /** Set a parameter as rosparam does: the server reads the text as YAML. */
  async set(name, text, shown) {
    clearTimeout(this.timer);
    say(shown, "");
    try {
      await this.link.tools.request({ do: "set", name, text });
      return true;
    } catch (error) {
      say(shown, error.message, true);
      return false;
    }
  }

  /** Show beside a text that is being typed which value it becomes. */
  preview(input, shown) {
    const text = input.value;
    clearTimeout(this.timer);
    if (!text.trim()) {
      say(shown, "");
      return;
    }
    this.timer = setTimeout(async () => {
      let found;
      let isWrong = false;
      try {
        const value = await this.link.tools.request({ do: "value", text });
        found = `${value.type}: ${value.text}`;
      } catch (error) {
        found = error.message;
        isWrong = true;
      }
      if (input.value === text && (input === this.value || document.activeElement === input))
        say(shown, found, isWrong);
    }, PREVIEW_MS);
  }

  async add() {
    const name = this.name.value.trim();
    if (!name) return;
    if (!(await this.set(name.startsWith("/") ? name : `/${name}`, this.value.value, this.typed))) return;
    this.name.value = this.value.value = "";
  }
}

/** Return a value as text of which the server reads the same value; the type says which numbers are doubles. */
export function textOf(value, type) {
  if (type === "float64_array") return `[${value.map((each) => textOf(each, "float64")).join(",")}]`;
  if (type === "float64" && Number.isInteger(value) && Math.abs(value) < 1e21) return `${value}.0`;
  // JSON, but for numbers such as 1e-7: to YAML 1.1 they are texts.
  return quoted(value).replace(/"(?:[^"\\]|\\.)*"|(-?\d+)(\.\d+)?e/g, (all, digits, fraction) =>
    digits === undefined || fraction ? all : `${digits}.0e`,
  );
}

function say(element, text, isWrong = false) {
  element.classList.toggle("error", isWrong);
  element.title = text; // it may be cut
  setText(element, text);
}
