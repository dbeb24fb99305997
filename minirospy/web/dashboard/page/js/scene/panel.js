// The list of displays: what is shown, its status, and its settings under RViz's names.

import { breakable, fill, h, refill, setText } from "../dom.js";
import { t } from "../texts.js";
import { CLASSES, classForType, classOf, getSetting, setSetting, topicKeyOf } from "./classes.js";
import { fromHex, hexOf, rgbOf } from "./colors.js";
import { LEVELS } from "./displays/display.js";

const WORDS = { ok: "OK", warn: "Warning", error: "Error" };
let nextId = 1;

export class Panel {
  constructor(view) {
    this.view = view;
    this.isStale = true;
    this.open = new Set(); // settings that are folded out
    this.rows = new Map(); // settings -> {dot, status, row}
    this.globalDot = h("span", { class: "dot" });
    this.globalText = h("p", { class: "hint" });
    this.background = h("input", { type: "color", "aria-label": "Background", onchange: () => this.setBackground() });
    this.automatic = h("input", { type: "checkbox", onchange: () => view.setAutomatic(this.automatic.checked) });
    this.choice = h("select", { class: "grow", "aria-label": "Add a display", onchange: () => this.add() });
    this.list = h("div", { class: "displays" });
    this.element = h(
      "div",
      { class: "panel side details scene-side" },
      h("div", { class: "bar" }, this.choice),
      h(
        "div",
        { class: "bar between" },
        h("label", { title: "Add a display for each topic that can be shown" }, this.automatic, "show new topics"),
        h("label", {}, t("background"), this.background),
      ),
      h(
        "div",
        { class: "display", "data-name": "Global Status" },
        h("div", { class: "display-head" }, this.globalDot, h("strong", {}, "Fixed frame"), this.globalText),
      ),
      this.list,
    );
    for (const name of ["pointerdown", "focus"]) this.choice.addEventListener(name, () => this.fillChoice());
    this.fillChoice();
  }

  fillChoice() {
    const topics = [...this.view.link.channels.values()].filter(({ type }) => classForType(type));
    const key = topics.map(({ topic }) => topic).join(" ");
    if (key === this.choices) return;
    this.choices = key;
    fill(
      this.choice,
      h("option", { value: "" }, "Add a display …"),
      topics.length
        ? h(
            "optgroup",
            { label: "By topic" },
            topics.map(({ topic, type }) =>
              h("option", { value: `${classForType(type)} ${topic}` }, `${topic} (${classForType(type)})`),
            ),
          )
        : null,
      h(
        "optgroup",
        { label: "By kind" },
        Object.keys(CLASSES)
          .filter((name) => name !== "Wrench")
          .map((name) => h("option", { value: name }, name)),
      ),
    );
  }

  add() {
    const [name, topic = ""] = this.choice.value.split(" ");
    this.choice.value = "";
    if (!name) return;
    const settings = this.view.add(name, topic);
    if (!topic) this.toggle(settings, true);
  }

  setBackground() {
    const color = fromHex(this.background.value);
    this.view.config.background = color;
    this.view.stage.background = rgbOf(color);
    this.view.changed();
  }

  // --- the list

  fill() {
    this.rows.clear();
    this.background.value = hexOf(this.view.config.background);
    refill(
      this.list,
      this.view.config.displays().map(({ settings, depth, isOn }) => this.row(settings, depth, isOn)),
    );
    this.isStale = true;
    this.look();
  }

  row(settings, depth, isOn) {
    const name = String(settings.Name ?? classOf(settings));
    const isKnown = Boolean(CLASSES[classOf(settings)]) || classOf(settings) === "Group";
    const dot = h("span", { class: "dot" });
    const title = h(
      "button",
      {
        type: "button",
        class: "display-name",
        "aria-expanded": "false",
        title: settings.Class,
        onclick: () => this.toggle(settings),
      },
      breakable(name),
    );
    const isEnabled = h("input", {
      type: "checkbox",
      checked: settings.Enabled !== false,
      disabled: !isKnown,
      "aria-label": t("show {name}", { name }),
      onchange: () => {
        settings.Enabled = settings.Value = isEnabled.checked;
        this.view.set(settings, "Enabled");
      },
    });
    const body = h("div", { class: "display-body", hidden: true });
    const row = h("div", { class: "display" }, h("div", { class: "display-head" }, isEnabled, dot, title), body);
    row.dataset.name = name;
    row.style.marginLeft = `${depth}rem`;
    row.classList.toggle("off", !isOn);
    this.rows.set(settings, { settings, row, dot, title, body, isKnown, status: null });
    if (this.open.has(settings)) this.unfold(settings);
    return row;
  }

  toggle(settings, isOpen = !this.open.has(settings)) {
    if (isOpen) this.open.add(settings);
    else this.open.delete(settings);
    this.unfold(settings);
    this.isStale = true;
    this.look();
  }

  unfold(settings) {
    const found = this.rows.get(settings);
    if (!found) return;
    const isOpen = this.open.has(settings);
    found.title.setAttribute("aria-expanded", String(isOpen));
    found.body.hidden = !isOpen;
    if (isOpen) this.fillBody(found);
  }

  fillBody(found) {
    const { settings, body, isKnown } = found;
    found.status = h("ul", { class: "display-status" });
    found.parts = h("div", { class: "parts" });
    const rows = (CLASSES[classOf(settings)]?.settings ?? [])
      .filter(([, , , isShown]) => !isShown || isShown(settings))
      .map((each) => this.editor(settings, each));
    const topic = CLASSES[classOf(settings)]?.isLinked ? getSetting(settings, topicKeyOf(classOf(settings))) : "";
    fill(
      body,
      found.status,
      isKnown
        ? rows
        : h(
            "p",
            { class: "hint" },
            t("{name} cannot be shown here. It is kept when the file is saved.", {
              name: settings.Class ?? t("a display without a class"),
            }),
          ),
      topic ? h("a", { href: `#/image?topic=${encodeURIComponent(topic)}` }, t("open the view Image")) : null,
      found.parts,
      h(
        "div",
        { class: "bar" },
        h("button", { type: "button", class: "small", onclick: () => this.rename(settings) }, "Rename"),
        h("button", { type: "button", class: "small", onclick: () => this.view.remove(settings) }, "Remove"),
      ),
    );
  }

  rename(settings) {
    const { title, row } = this.rows.get(settings);
    const field = h("input", { type: "text", class: "rename", value: settings.Name ?? "", "aria-label": "Name" });
    const end = () => {
      settings.Name = field.value.trim() || settings.Name;
      fill(title, breakable(settings.Name));
      row.dataset.name = settings.Name;
      field.replaceWith(title);
      this.view.changed();
    };
    field.addEventListener("change", end, { once: true });
    field.addEventListener("blur", end, { once: true });
    title.replaceWith(field);
    field.focus();
  }

  /** Return the line of a setting. */
  editor(settings, [path, { kind, options = [], types }]) {
    const value = getSetting(settings, path);
    const set = (changed) => {
      setSetting(settings, path, changed);
      this.view.set(settings, path);
      const found = this.rows.get(settings);
      // Other settings may have a meaning now.
      if (found && (kind === "choice" || kind === "bool")) this.fillBody(found);
      this.isStale = true;
      this.look();
    };
    const editors = {
      bool: () =>
        h("input", { type: "checkbox", checked: value === true, onchange: ({ target }) => set(target.checked) }),
      number: () =>
        h("input", {
          type: "number",
          step: "any",
          value: Number(Number(value).toPrecision(6)),
          onchange: ({ target }) => {
            if (target.value !== "" && target.validity.valid) set(Number(target.value));
          },
        }),
      color: () =>
        h("input", { type: "color", value: hexOf(value), onchange: ({ target }) => set(fromHex(target.value)) }),
      choice: () =>
        h(
          "select",
          { value, onchange: ({ target }) => set(target.value) },
          [...new Set([...options, value].filter(Boolean))].map((each) =>
            h("option", { value: each, selected: each === value }, each),
          ),
        ),
      text: () => h("input", { type: "text", value: value ?? "", onchange: ({ target }) => set(target.value.trim()) }),
      topic: () =>
        this.listed(value, set, () =>
          [...this.view.link.channels.values()]
            .filter(({ type }) => (types ?? CLASSES[classOf(settings)].types).includes(type))
            .map(({ topic }) => topic),
        ),
      frame: () => this.listed(value, set, () => ["<Fixed Frame>", ...this.view.context.frames.names()]),
    };
    const control = editors[kind]();
    const name = path.replace(/\/Value$/, "");
    control.setAttribute("aria-label", name);
    return h("label", { class: "setting" }, h("span", {}, name.replaceAll("/", " ")), control);
  }

  /** Return a field that offers names. */
  listed(value, set, names) {
    const id = `names-${nextId++}`;
    const list = h("datalist", { id });
    return h(
      "span",
      { class: "listed" },
      h("input", {
        type: "text",
        value: value ?? "",
        list: id,
        autocomplete: "off",
        onfocus: () =>
          fill(
            list,
            names().map((each) => h("option", { value: each })),
          ),
        onchange: ({ target }) => set(target.value.trim()),
      }),
      list,
    );
  }

  // --- statuses

  look() {
    const { view } = this;
    if (!this.isStale || !view.context) return;
    this.isStale = false;
    this.automatic.checked = view.state.isAutomatic;
    const [level, text] = view.context.fixedStatus();
    this.mark(this.globalDot, level);
    setText(this.globalText, level ? text : `${view.context.fixedFrame}: OK`);
    this.globalText.classList.toggle("error", level === 2);
    for (const [settings, found] of this.rows) this.showStatus(settings, found);
  }

  showStatus(settings, found) {
    const display = this.view.displays.get(settings);
    const { dot, row, status, parts, isKnown } = found;
    if (!display) {
      dot.className = "dot";
      if (!isKnown) this.mark(dot, 1);
      if (status) fill(status);
      return;
    }
    this.mark(dot, display.level());
    row.dataset.level = LEVELS[display.level()];
    row.classList.toggle("gone", display.isGone === true);
    if (status)
      fill(
        status,
        [...display.status].map(([name, [level, text]]) => h("li", { class: LEVELS[level] }, `${name}: ${text}`)),
      );
    if (parts && display.parts) this.fillParts(parts, settings, display);
  }

  /** Show the parts of a display that can be shown or not: frames, namespaces. */
  fillParts(element, settings, display) {
    const found = display.parts();
    const key = found.map(({ name, isShown }) => `${name} ${isShown}`).join("\n");
    if (element.dataset.key === key) return;
    element.dataset.key = key;
    refill(
      element,
      found.map(({ name, isShown, set }) =>
        h(
          "label",
          { class: "part" },
          h("input", {
            type: "checkbox",
            checked: isShown,
            onchange: ({ target }) => {
              set(target.checked);
              this.view.set(settings, "Frames");
            },
          }),
          name,
        ),
      ),
    );
  }

  mark(dot, level) {
    dot.className = `dot ${LEVELS[level]}`;
    dot.title = t(WORDS[LEVELS[level]]);
  }
}
