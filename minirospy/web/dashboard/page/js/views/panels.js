// Small panels for lessons: values, lamps, gauges, switches, sliders and buttons, bound to a field of a topic or a
// service; kept in the link.

import { fill, h, setText, shown, svg, uniqueId } from "../dom.js";
import { numberOf, numericPaths } from "../paths.js";
import { t, errorText } from "../texts.js";
import {
  COLORS,
  KINDS,
  MAX_PANELS,
  TYPES,
  isSame,
  messageWith,
  panelText,
  parsePanel,
  splitPath,
  valueAt,
} from "../widgets.js";

const SEND_MS = 50; // between two messages of a slider that is moved
const LABELS = {
  unit: "unit",
  at: "on from",
  color: "color",
  min: "least",
  max: "most",
  step: "step",
  on: "value when on",
  off: "value when off",
  release: "value when released",
  type: "type",
};

export class Panels {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.panels = words
      .getAll("p")
      .map(parsePanel)
      .filter(Boolean)
      .slice(0, MAX_PANELS)
      .map((spec) => this.make(spec));
    this.isEditing = words.get("edit") === "1" || !this.panels.length;
    this.editing = null; // the panel whose settings are in the form
    this.editButton = h(
      "button",
      { type: "button", "aria-pressed": String(this.isEditing), onclick: () => this.switchEditing() },
      t("Edit"),
    );
    this.problem = h("span", { class: "error", role: "alert" });
    this.grid = h("div", { class: "widgets" });
    this.empty = h(
      "p",
      { class: "empty" },
      t("Choose a kind of panel, and the field of a topic that it shows or sets."),
    );
    this.form = this.makeForm();
    main.append(h("div", { class: "bar" }, this.editButton, this.problem), this.form, this.grid, this.empty);
    this.ending = link.watch(["channels", "services", "state", "graph"], () => this.update());
    this.draw();
  }

  close() {
    this.ending();
    for (const panel of this.panels) panel.close();
  }

  make(spec) {
    const panel = new Panel(this.link, spec);
    panel.update();
    return panel;
  }

  remember() {
    this.place.remember([
      ...this.panels.map(({ spec }) => ["p", panelText(spec)]),
      ...(this.isEditing && this.panels.length ? [["edit", "1"]] : []),
    ]);
  }

  update() {
    const paths = [];
    for (const { topic, type, schema } of this.link.channels.values()) {
      const definition = this.link.definition(type, schema);
      if (definition && paths.length < 2000) paths.push(...numericPaths(definition, 40).map((path) => topic + path));
    }
    fill(
      this.known,
      [...paths, ...this.link.services.keys()].map((value) => h("option", { value })),
    );
    for (const panel of this.panels) panel.update();
  }

  // --- editing

  switchEditing() {
    this.isEditing = !this.isEditing;
    this.editing = null;
    this.draw();
    this.remember();
  }

  makeForm() {
    this.kind = h(
      "select",
      { "aria-label": t("Kind of panel"), onchange: () => this.showSettings({}) },
      Object.entries(KINDS).map(([kind, { title }]) => h("option", { value: kind }, t(title))),
    );
    this.known = h("datalist", { id: uniqueId("fields") });
    this.path = h("input", {
      class: "grow",
      "aria-label": t("Field of a topic, or service"),
      placeholder: t("/topic/field or /service"),
      autocomplete: "off",
      list: this.known.id,
    });
    this.label = h("input", { "aria-label": t("Label"), placeholder: t("Label"), autocomplete: "off", maxlength: 40 });
    this.settings = h("span", { class: "bar" });
    this.submit = h("button", { type: "submit", class: "primary" });
    const form = h(
      "form",
      {
        class: "bar panel details",
        onsubmit: (event) => {
          event.preventDefault();
          this.put();
        },
      },
      this.kind,
      this.path,
      this.known,
      this.label,
      this.settings,
      this.submit,
    );
    return form;
  }

  showSettings(given) {
    const field = (name, usual) => {
      const value = given[name] ?? usual;
      if (name === "color" || name === "type") {
        const names = name === "color" ? COLORS : Object.keys(TYPES);
        const choice = h(
          "select",
          { name, "aria-label": t(LABELS[name]) },
          name === "type" ? h("option", { value: "" }, t("the topic's type")) : null,
          names.map((each) => h("option", { value: each }, name === "color" ? t(each) : each)),
        );
        choice.value = value;
        return choice;
      }
      return h("label", {}, t(LABELS[name]), h("input", { name, value, class: "short", autocomplete: "off" }));
    };
    fill(
      this.settings,
      Object.entries(KINDS[this.kind.value].settings).map(([name, usual]) => field(name, usual)),
    );
  }

  edit(panel) {
    this.editing = panel;
    const { spec } = panel;
    this.kind.value = spec.kind;
    this.path.value = spec.path;
    this.label.value = spec.label;
    this.showSettings(spec);
    this.draw();
    this.path.focus();
  }

  put() {
    const typed = this.path.value.trim();
    const path = typed.startsWith("/") ? typed : `/${typed}`;
    const settings = Object.fromEntries(
      [...this.settings.querySelectorAll("[name]")].map((each) => [each.name, each.value.trim()]),
    );
    const isService =
      KINDS[this.kind.value].isWriter &&
      !splitOrNull(path, this.link.channels.keys()) &&
      Boolean(splitOrNull(path, this.link.services.keys()));
    const spec = { kind: this.kind.value, path, label: this.label.value.trim(), isService, ...settings };
    if (path.length < 2) {
      setText(this.problem, t("Type a topic and a field, as /button_state/data."));
      return;
    }
    setText(this.problem, "");
    const panel = this.make(spec);
    if (this.editing) {
      this.editing.close();
      this.panels[this.panels.indexOf(this.editing)] = panel;
    } else if (this.panels.length < MAX_PANELS) this.panels.push(panel);
    this.editing = null;
    this.path.value = this.label.value = "";
    this.showSettings({});
    this.draw();
    this.remember();
  }

  move(panel, step) {
    const at = this.panels.indexOf(panel);
    const to = at + step;
    if (to < 0 || to >= this.panels.length) return;
    [this.panels[at], this.panels[to]] = [this.panels[to], this.panels[at]];
    this.draw();
    this.remember();
  }

  remove(panel) {
    panel.close();
    this.panels.splice(this.panels.indexOf(panel), 1);
    if (this.editing === panel) this.editing = null;
    if (!this.panels.length) this.isEditing = true;
    this.draw();
    this.remember();
  }

  draw() {
    this.editButton.setAttribute("aria-pressed", String(this.isEditing));
    this.form.hidden = !this.isEditing;
    setText(this.submit, this.editing ? t("Change") : t("Add"));
    if (!this.settings.children.length) this.showSettings({});
    this.empty.hidden = this.panels.length > 0;
    const small = (label, text, react) =>
      h("button", { type: "button", class: "small", title: label, "aria-label": label, onclick: react }, text);
    fill(
      this.grid,
      this.panels.map((panel) => {
        fill(
          panel.tools,
          this.isEditing
            ? [
                small(t("Move to the left"), "←", () => this.move(panel, -1)),
                small(t("Move to the right"), "→", () => this.move(panel, 1)),
                small(t("Change this panel"), "✎", () => this.edit(panel)),
                small(t("Remove this panel"), "×", () => this.remove(panel)),
              ]
            : [],
        );
        panel.element.classList.toggle("selected", panel === this.editing);
        return panel.element;
      }),
    );
  }
}

function splitOrNull(path, names) {
  try {
    return splitPath(path, names);
  } catch {
    return null;
  }
}

/** Return a number with these digits behind its point; one that is far beyond the range with four in all. */
function readingOf(value, digits) {
  const text = String(Number(value.toFixed(digits)));
  return text.length > 8 ? String(Number(value.toPrecision(4))) : text;
}

/** One panel. */
class Panel {
  constructor(link, spec) {
    this.link = link;
    this.spec = spec;
    this.end = null;
    this.name = null; // of the topic or service, once it is known
    this.steps = [];
    this.isAdvertised = false;
    this.known = null; // {topic, type, schema} of a topic that is only subscribed
    this.tools = h("span", { class: "widget-tools" });
    this.note = h("p", { class: "muted note", role: "status" });
    this.title = spec.label || spec.path;
    this.element = h(
      "section",
      { class: `panel widget ${spec.kind}`, "aria-label": this.title },
      h("div", { class: "widget-head" }, h("h3", { title: spec.path }, this.title), this.tools),
      this.body(),
      this.note,
    );
    this.element.dataset.path = spec.path;
    for (const control of this.element.querySelectorAll("button, input")) control.disabled = true;
  }

  close() {
    clearTimeout(this.timer);
    this.letGo?.();
    this.end?.();
    if (this.isAdvertised) this.link.unpublish(this.name);
  }

  /** Find what the path means, once it is known. */
  update() {
    const { spec, link } = this;
    if (link.state !== "open") {
      this.isAdvertised = false;
      return;
    }
    let found;
    try {
      found = splitPath(spec.path, spec.isService ? link.services.keys() : link.channels.keys());
      // A topic that nobody publishes has the name that was typed; the type says what its field is.
      if (!found && !spec.isService && !spec.type && KINDS[spec.kind].isWriter) found = this.subscribed();
      if (!found && !spec.isService && spec.type)
        found = [spec.path.replace(/\/data$/, ""), spec.path.endsWith("/data") ? ["data"] : []];
    } catch (error) {
      this.say(errorText(error), true);
      return;
    }
    if (!found) {
      if (!this.name) this.say(t("waiting for {path}", { path: spec.path }));
      return;
    }
    const [name, steps] = found;
    if (this.name && name !== this.name && this.isAdvertised) {
      this.link.unpublish(this.name);
      this.isAdvertised = false;
    }
    this.advertise(name);
    if (name === this.name) return;
    this.end?.();
    this.name = name;
    for (const control of this.element.querySelectorAll("button, input")) control.disabled = false;
    this.steps = steps;
    this.say("");
    if (!spec.isService) this.end = link.subscribe({ topic: name, mode: "latest" }, (item) => this.received(item));
  }

  /**
   * Return the topic and the steps of a path to what nodes subscribe to and nobody publishes; null until its type is
   * known.
   */
  subscribed() {
    const { link, spec } = this;
    const found = splitPath(spec.path, link.graph.subscribed.keys());
    if (!found) return null;
    const [topic] = found;
    if (this.known?.topic === topic) return this.known.schema === undefined ? null : found;
    this.known = { topic };
    link.tools.request({ do: "type", topic }).then(
      ({ name, definition }) => {
        this.known = { topic, type: name, schema: definition };
        this.update();
      },
      (error) => {
        this.known = null; // it is looked up again when the graph changes
        if (!this.name) this.say(error.message, true);
      },
    );
    return null;
  }

  /** Show a line below the panel, in red if something is wrong. */
  say(text, isWrong = false) {
    this.note.classList.toggle("error", isWrong);
    setText(this.note, text);
  }

  /**
   * Publish a topic that is to be set before its first message: those before its subscribers are connected are lost.
   */
  advertise(name) {
    const channel = this.channel(name);
    if (this.isAdvertised || this.spec.isService || !KINDS[this.spec.kind].isWriter || channel.schema === undefined)
      return;
    this.isAdvertised = true;
    this.link.advertise(name, channel.type, channel.schema);
  }

  /** Return the type of a topic: {type, schema}, that of its publishers or the chosen one. */
  channel(name) {
    return (
      this.link.channels.get(name) ??
      (this.known?.topic === name ? this.known : { type: this.spec.type, schema: TYPES[this.spec.type] })
    );
  }

  received({ message, error }) {
    if (error) this.say(error, true);
    if (!message) return;
    const value = valueAt(message, this.steps);
    if (value === undefined) this.say(t("{name} has no such field", { name: this.name }), true);
    else if (this.spec.kind === "gauge" && numberOf(value) === null)
      this.say(t("{name} is not a number", { name: this.spec.path }), true);
    else this.show(value);
  }

  number(name) {
    return Number(this.spec[name]) || 0;
  }

  body() {
    const { spec } = this;
    if (spec.kind === "value") {
      const text = h("output", { class: "big" }, "–");
      this.show = (value) => {
        const found = typeof value === "boolean" ? null : numberOf(value);
        setText(
          text,
          `${found === null ? shown(value, 60) : Number(found.toPrecision(5))}${spec.unit ? ` ${spec.unit}` : ""}`,
        );
      };
      return text;
    }
    if (spec.kind === "lamp") {
      const lamp = h("div", {
        class: `bulb ${COLORS.includes(spec.color) ? spec.color : "green"}`,
        role: "img",
        "aria-label": t("off"),
      });
      this.show = (value) => {
        const isOn = typeof value === "string" ? value === spec.at : (numberOf(value) ?? 0) >= this.number("at");
        lamp.classList.toggle("lit", isOn);
        lamp.setAttribute("aria-label", isOn ? t("on") : t("off"));
      };
      return lamp;
    }
    if (spec.kind === "gauge") return this.gauge();
    if (spec.kind === "switch") {
      const button = h("button", {
        type: "button",
        class: "toggle",
        role: "switch",
        "aria-checked": "false",
        "aria-label": this.title,
        onclick: () => {
          const isOn = button.getAttribute("aria-checked") !== "true";
          if (!this.send(isOn ? spec.on : spec.off)) return;
          button.setAttribute("aria-checked", String(isOn));
          // Its own earlier values are still to come back: what comes last within this time is shown then.
          last = isOn;
          clearTimeout(this.timer);
          this.timer = setTimeout(() => {
            this.timer = null;
            button.setAttribute("aria-checked", String(last));
          }, 1000);
        },
      });
      let last = false;
      this.show = (value) => {
        last = !isSame(value, spec.off);
        if (!this.timer) button.setAttribute("aria-checked", String(last));
      };
      return button;
    }
    if (spec.kind === "slider") return this.slider();
    return this.button();
  }

  gauge() {
    const { spec } = this;
    const [min, max] = [this.number("min"), this.number("max")];
    const arc = (share) => {
      const angle = Math.PI * (1 - share);
      return `M 10 60 A 50 50 0 0 1 ${(60 + 50 * Math.cos(angle)).toFixed(2)} ${(60 - 50 * Math.sin(angle)).toFixed(2)}`;
    };
    const needle = svg("path", { class: "filled", d: arc(0.001) });
    const text = svg("text", { x: 60, y: 58, class: "reading" }, "–");
    const picture = svg(
      "svg",
      {
        viewBox: "0 0 120 78",
        class: "meter",
        role: "meter",
        "aria-valuemin": min,
        "aria-valuemax": max,
        "aria-label": this.title,
      },
      svg("path", { class: "track", d: arc(1) }),
      needle,
      text,
      svg("text", { x: 10, y: 75, class: "end" }, spec.min),
      svg("text", { x: 110, y: 75, class: "end" }, spec.max),
    );
    // a thousandth of its range
    const digits = Math.min(6, Math.max(0, 3 - Math.floor(Math.log10(Math.abs(max - min) || 1))));
    this.show = (value) => {
      const found = numberOf(value) ?? NaN;
      const share = max === min ? 0 : Math.min(1, Math.max(0, (found - min) / (max - min)));
      needle.setAttribute("d", arc(Math.max(0.001, Number.isFinite(share) ? share : 0)));
      needle.classList.toggle("over", found > max || found < min);
      setText(text, `${Number.isFinite(found) ? readingOf(found, digits) : "–"}${spec.unit ? ` ${spec.unit}` : ""}`);
      picture.setAttribute("aria-valuenow", String(found));
    };
    return picture;
  }

  slider() {
    const { spec } = this;
    const text = h("output", { class: "num" }, "–");
    const step = spec.step || String((this.number("max") - this.number("min")) / 100 || 0.01);
    const input = h("input", {
      type: "range",
      min: spec.min,
      max: spec.max,
      step,
      "aria-label": this.title,
      oninput: () => {
        setText(text, `${input.value} ${spec.unit}`);
        // The newest value at 20 Hz: a drag makes far more.
        this.timer ??= setTimeout(() => {
          this.timer = null;
          this.send(input.value);
        }, SEND_MS);
      },
    });
    input.value = spec.min; // before the limits were set, it was 50
    this.show = (value) => {
      const found = numberOf(value);
      if (found === null || this.timer || document.activeElement === input) return;
      input.value = String(found);
      setText(text, `${Number(found.toPrecision(4))} ${spec.unit}`);
    };
    return h("div", { class: "sliding" }, input, text);
  }

  button() {
    const { spec } = this;
    this.show = () => {};
    const button = h("button", { type: "button", class: "primary push-button" }, this.title);
    if (!spec.release) button.addEventListener("click", () => this.send(spec.on));
    else {
      const press = () => {
        if (!this.isHeld) {
          this.isHeld = true;
          this.send(spec.on);
        }
      };
      const release = (this.letGo = () => {
        if (this.isHeld) {
          this.isHeld = false;
          this.send(spec.release);
        }
      });
      button.addEventListener("pointerdown", (event) => {
        button.setPointerCapture(event.pointerId);
        press();
      });
      for (const name of ["pointerup", "pointercancel", "blur"]) button.addEventListener(name, release);
      button.addEventListener("keydown", (event) => {
        if (event.key === " " || event.key === "Enter") press();
      });
      button.addEventListener("keyup", release);
    }
    return button;
  }

  /** Publish or call; return whether that could be started. */
  send(text) {
    if (!this.link.mayWrite) return this.fail(t("This token is read-only."));
    if (!this.name) return this.fail(t("waiting for {path}", { path: this.spec.path }));
    try {
      const sending = this.spec.isService ? this.call(text) : this.publish(text);
      sending.then(
        (answer) => this.say(answer),
        (error) => this.fail(errorText(error)),
      );
      return true;
    } catch (error) {
      return this.fail(errorText(error));
    }
  }

  fail(text) {
    this.say(text, true);
    return false;
  }

  publish(text) {
    const channel = this.channel(this.name);
    if (channel.schema === undefined)
      throw new Error(t("nobody publishes {name}: choose its type", { name: this.name }));
    const definition = this.link.definition(channel.type, channel.schema);
    if (!definition) throw new Error(channel.type);
    const message = messageWith(definition, this.steps, text);
    return this.link.publish(this.name, channel.type, channel.schema, message).then(() => "");
  }

  async call(text) {
    const service = this.link.services.get(this.name);
    if (!service) throw new Error(t("there is no service {name}", { name: this.name }));
    const definition = this.link.definition(`${service.type}Request`, service.request);
    const request =
      definition.fields.length && (this.steps.length || definition.fields.length === 1)
        ? messageWith(definition, this.steps, text)
        : {};
    const response = await this.link.call(this.name, request);
    const parts = Object.values(response);
    return parts.length ? shown(parts.length === 1 ? parts[0] : response, 100) : t("done");
  }
}
