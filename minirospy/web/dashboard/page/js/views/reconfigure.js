// Reconfigure: the parameters of dynamic_reconfigure servers as sliders, switches and selections; saved to and loaded
// from YAML.

import { download, fill, h, setText } from "../dom.js";
import { converted, describe, requestOf, shownNumber, sliderStep, statesOf, valuesOf, yamlOf } from "../reconfigure.js";
import { t, errorText } from "../texts.js";

const DESCRIPTIONS = "/parameter_descriptions";
const UPDATES = "/parameter_updates";
const SERVICE = "/set_parameters";
const TYPE = "dynamic_reconfigure/ConfigDescription";
const NOTE_MS = 6000;
const MAX_FILE_SIZE = 90_000; // the server parses no more

export class Reconfigure {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.panels = new Map(); // name of a server -> its panel
    this.rows = new Map();
    this.wanted = new Set(words.getAll("node"));
    this.filter = h("input", {
      type: "search",
      placeholder: "Filter servers",
      "aria-label": "Filter",
      oninput: () => this.showFiltered(),
    });
    this.list = h("div", { class: "servers", role: "group", "aria-label": "Servers" });
    this.area = h("div", { class: "configs" });
    this.empty = h("p", { class: "empty" });
    main.append(
      h(
        "div",
        { class: "split reconfigure" },
        h("aside", { class: "panel details side" }, this.filter, this.list),
        h("div", { class: "scroll" }, this.area, this.empty),
      ),
    );
    this.ending = link.watch(["channels", "services", "state"], () => this.update());
  }

  close() {
    this.ending();
    for (const panel of this.panels.values()) panel.close();
  }

  /** Return the names of the servers that are there. */
  servers() {
    const found = [];
    for (const { topic, type } of this.link.channels.values()) {
      if (type === TYPE && topic.endsWith(DESCRIPTIONS)) found.push(topic.slice(0, -DESCRIPTIONS.length));
    }
    return found;
  }

  update() {
    // While the connection is lost, what is shown stays.
    if (this.link.state !== "open") {
      for (const panel of this.panels.values()) panel.showState(true);
      return;
    }
    const servers = this.servers();
    for (const [name, row] of this.rows) {
      if (servers.includes(name)) continue;
      row.remove();
      this.rows.delete(name);
    }
    let before = null;
    for (const name of servers) {
      let row = this.rows.get(name);
      if (!row) {
        row = h(
          "button",
          { type: "button", class: "server", "aria-pressed": "false", onclick: () => this.choose(name) },
          name || "/",
        );
        this.rows.set(name, row);
      }
      const next = before ? before.nextSibling : this.list.firstChild;
      if (row !== next) this.list.insertBefore(row, next);
      before = row;
      if (this.panels.has(name)) continue;
      const opensItself = servers.length === 1 && !this.wasAsked && !this.wanted.has(name);
      if (opensItself) this.openedItself = name;
      if (opensItself || this.wanted.has(name)) this.open(name);
    }
    for (const [name, panel] of this.panels) panel.showState(servers.includes(name));
    this.showFiltered();
  }

  choose(name) {
    // The first click on the server that has opened by itself is meant to open it.
    if (this.openedItself === name && !this.wasAsked && this.panels.has(name)) {
      this.wasAsked = true;
      this.remember();
    } else this.toggle(name);
  }

  toggle(name) {
    this.wasAsked = true;
    if (this.panels.has(name)) this.shut(name);
    else this.open(name);
    this.remember();
  }

  open(name) {
    this.wanted.add(name);
    const panel = new Panel(this.link, name, () => this.toggle(name));
    this.panels.set(name, panel);
    this.area.append(panel.element);
    panel.showState(this.rows.has(name));
    this.showFiltered();
  }

  shut(name) {
    this.wanted.delete(name);
    this.panels.get(name).close();
    this.panels.get(name).element.remove();
    this.panels.delete(name);
    this.showFiltered();
  }

  remember() {
    this.place.remember({ node: [...this.wanted] });
  }

  showFiltered() {
    const words = this.filter.value.toLowerCase();
    for (const [name, row] of this.rows) {
      row.hidden = !name.toLowerCase().includes(words);
      row.setAttribute("aria-pressed", String(this.panels.has(name)));
    }
    setText(
      this.empty,
      this.panels.size || this.link.state !== "open"
        ? ""
        : this.rows.size
          ? t("Choose a server on the left.")
          : t("No node offers dynamic_reconfigure. Start one: it appears here."),
    );
  }
}

class Panel {
  constructor(link, name, shut) {
    this.link = link;
    this.name = name;
    this.description = null;
    this.values = new Map();
    this.states = new Map();
    this.controls = new Map(); // name of a parameter -> its control
    this.groups = [];
    this.changes = new Map(); // that wait until the call before them is answered
    this.sent = new Map(); // that the server has not answered yet
    this.sentStates = null;
    this.isCalling = false;
    this.result = h("p", { class: "note", role: "status" });
    this.body = h("div", { class: "config" }, h("p", { class: "muted" }, t("waiting for its description …")));
    this.file = h("input", {
      type: "file",
      accept: ".yaml,.yml",
      hidden: true,
      "aria-label": t("File for {name}", { name }),
      onchange: () => this.load(),
    });
    this.saveButton = h("button", { type: "button", disabled: true, onclick: () => this.save() }, "Save");
    this.loadButton = h("button", { type: "button", disabled: true, onclick: () => this.file.click() }, "Load");
    this.usualButton = h("button", { type: "button", disabled: true, onclick: () => this.reset() }, "Defaults");
    this.element = h(
      "section",
      { class: "panel details", "aria-label": name },
      h(
        "div",
        { class: "bar" },
        h("h2", {}, name || "/"),
        this.result,
        this.saveButton,
        this.loadButton,
        this.usualButton,
        this.file,
        h("button", { type: "button", title: t("Close {name}", { name }), onclick: shut }, "×"),
      ),
      this.body,
    );
    this.element.dataset.server = name;
    this.ends = [
      link.subscribe({ topic: name + DESCRIPTIONS, mode: "latest" }, (item) => this.described(item)),
      link.subscribe({ topic: name + UPDATES, mode: "latest" }, (item) => this.updated(item)),
    ];
  }

  close() {
    clearTimeout(this.noteTimer);
    for (const end of this.ends) end();
  }

  get mayChange() {
    return this.isThere && this.link.services.has(this.name + SERVICE);
  }

  showState(isThere) {
    this.isThere = isThere && this.link.state === "open";
    this.element.classList.toggle("gone", !isThere);
    const mayChange = this.mayChange && this.description !== null;
    for (const control of this.controls.values()) control.enable(mayChange);
    for (const group of this.groups) group.enable?.(mayChange);
    this.saveButton.disabled = !this.values.size;
    this.loadButton.disabled = this.usualButton.disabled = !mayChange;
    if (!isThere) this.note(t("This server has left."), true, true);
    else if (this.link.state === "open" && !this.link.mayWrite)
      this.note(t("This token is read-only: values are shown and cannot be changed."), false, true);
    else if (this.isStateShown) this.note("");
  }

  note(text, isError = false, isState = false) {
    this.isStateShown = isState;
    setText(this.result, text);
    this.result.classList.toggle("error", isError);
    clearTimeout(this.noteTimer);
    if (text && !isError && !isState) this.noteTimer = setTimeout(() => setText(this.result, ""), NOTE_MS);
  }

  described({ message, error }) {
    if (error) return this.note(error, true);
    const text = JSON.stringify(message, (_, each) =>
      Number.isFinite(each) || typeof each !== "number" ? each : String(each),
    );
    if (text === this.text) return undefined;
    this.text = text;
    this.description = describe(message);
    this.controls.clear();
    this.groups = [];
    fill(
      this.body,
      this.makeGroup(this.description.root, (name, value) => this.change(name, value)),
    );
    this.show();
    return this.showState(this.isThere);
  }

  updated({ message, error }) {
    if (error) return this.note(error, true);
    this.values = valuesOf(message);
    for (const [id, state] of statesOf(message)) this.states.set(id, state);
    return this.show();
  }

  show() {
    // What a person has just set stays while older values still arrive.
    for (const [name, control] of this.controls) {
      const value = this.changes.get(name) ?? this.sent.get(name) ?? this.values.get(name);
      if (value !== undefined) control.show(value);
    }
    for (const group of this.groups) group.show(this.states.get(group.id) ?? true);
    this.saveButton.disabled = !this.values.size;
  }

  // --- groups

  makeGroup(group, change) {
    const parts = group.parameters.map((parameter) => this.makeRow(parameter, change));
    let tabs = null;
    for (const each of group.groups) {
      if (each.type === "tab") {
        if (!tabs) parts.push((tabs = makeTabs()).element);
        tabs.add(each.name, this.makeGroup(each, change));
      } else parts.push(this.makeBox(each, change));
    }
    return parts;
  }

  makeBox(group, change) {
    if (group.type === "apply") return this.makeApplied(group);
    const inside = h("div", {}, this.makeGroup(group, change));
    const box = h("fieldset", { class: "group" }, h("legend", {}, group.name), inside);
    box.dataset.group = group.name;
    if (group.type === "hide")
      this.groups.push({
        id: group.id,
        show: (state) => {
          box.hidden = !state;
        },
      });
    if (group.type === "collapse") {
      const fold = h("button", {
        type: "button",
        class: "fold",
        "aria-label": t("Open {name}", { name: group.name }),
        onclick: () => this.setState(group.id, inside.hidden),
      });
      const show = (state) => {
        inside.hidden = !state;
        fold.setAttribute("aria-expanded", String(state));
      };
      box.firstChild.prepend(fold);
      this.groups.push({ id: group.id, show });
    }
    return box;
  }

  /** Return a box whose changes are sent together. */
  makeApplied(group) {
    const waiting = new Map();
    const apply = h(
      "button",
      {
        type: "button",
        class: "primary",
        disabled: true,
        onclick: () => {
          for (const [name, value] of waiting) this.changes.set(name, value);
          discardAll();
          this.send();
        },
      },
      "Apply",
    );
    const discard = h(
      "button",
      {
        type: "button",
        disabled: true,
        onclick: () => {
          discardAll();
          this.show();
        },
      },
      "Discard",
    );
    const update = () => {
      apply.disabled = discard.disabled = !waiting.size || !this.mayChange;
      for (const [name, control] of this.controls)
        if (inside.contains(control.element)) control.mark(waiting.has(name));
    };
    const discardAll = () => {
      waiting.clear();
      update();
    };
    const inside = h("div", {});
    fill(
      inside,
      this.makeGroup(group, (name, value) => {
        waiting.set(name, value);
        update();
      }),
      h("div", { class: "bar" }, apply, discard),
    );
    this.groups.push({ id: group.id, show: () => {}, enable: update });
    const box = h("fieldset", { class: "group" }, h("legend", {}, group.name), inside);
    box.dataset.group = group.name;
    return box;
  }

  async setState(id, state) {
    this.states.set(id, state);
    this.show();
    if (!this.mayChange) return;
    this.sentStates = true;
    await this.send();
  }

  // --- parameters

  makeRow(parameter, change) {
    const label = h("span", { class: "key" }, parameter.name);
    const control = makeControl(parameter, (given) => {
      try {
        const value = converted(parameter, given);
        this.note("");
        control.show(value, true);
        change(parameter.name, value);
      } catch (error) {
        this.note(errorText(error), true);
      }
    });
    this.controls.set(parameter.name, control);
    const row = h(
      "div",
      { class: "parameter-row", title: limits(parameter) },
      label,
      control.element,
      h("span", { class: "muted about" }, parameter.description),
    );
    row.dataset.parameter = parameter.name;
    return row;
  }

  change(name, value) {
    this.changes.set(name, value);
    this.send();
  }

  /** Send what has changed: one call at a time, so that a slider does not make a queue. */
  async send() {
    if (this.isCalling) return;
    this.isCalling = true;
    try {
      while (this.changes.size || this.sentStates) {
        this.sent = this.changes;
        this.changes = new Map();
        const hasStates = this.sentStates;
        this.sentStates = null;
        await this.call(this.sent, hasStates);
      }
    } finally {
      this.isCalling = false;
    }
  }

  async call(sent, hasStates) {
    const { root, parameters } = this.description;
    try {
      const { config } = await this.link.call(this.name + SERVICE, {
        config: requestOf(parameters, sent, hasStates ? root : null, this.states),
      });
      const values = valuesOf(config);
      const corrected = [...sent].filter(
        ([name, value]) => values.has(name) && !Object.is(values.get(name), value) && !this.changes.has(name),
      );
      for (const [name, value] of values) this.values.set(name, value);
      this.sent = new Map();
      this.show();
      for (const [name] of corrected) this.controls.get(name)?.flash();
      const texts = corrected.map(([name, value]) =>
        t("{name}: {value} instead of {wanted}", {
          name,
          value: shownNumber(values.get(name)),
          wanted: shownNumber(value),
        }),
      );
      if (texts.length)
        this.note(
          t("The server has set {values}.", {
            values: `${texts.slice(0, 3).join(", ")}${texts.length > 3 ? ", …" : ""}`,
          }),
        );
    } catch (error) {
      this.sent = new Map();
      // rospy's server fails on the states of groups in every release; what a person sees is folded all the same.
      if (hasStates && !sent.size) return;
      this.note(
        t("The server refuses {names}: {why}", { names: [...sent.keys()].join(", "), why: error.message }),
        true,
      );
      this.show();
    }
  }

  reset() {
    for (const { name, usual } of this.description.parameters.values())
      if (usual !== undefined && !Object.is(usual, this.values.get(name))) this.changes.set(name, usual);
    this.send();
  }

  // --- files

  save() {
    const { parameters } = this.description ?? { parameters: new Map() };
    const name = this.name.split("/").filter(Boolean).join("_") || "config";
    download(`${name}.yaml`, new Blob([yamlOf(parameters, this.values)], { type: "application/yaml" }));
  }

  async load() {
    const [file] = this.file.files;
    this.file.value = "";
    if (!file) return;
    try {
      if (file.size > MAX_FILE_SIZE) throw new Error(t("the file is too large"));
      const values = await this.link.tools.request({ do: "yaml", text: await file.text() });
      const { parameters } = this.description;
      const names = Object.keys(values);
      const known = names.filter((name) => parameters.has(name));
      if (!known.length) throw new Error(t("none of its names is a parameter of {name}", { name: this.name }));
      const found = known.map((name) => [name, converted(parameters.get(name), values[name])]);
      for (const [name, value] of found) this.changes.set(name, value);
      const others = names.filter((name) => !parameters.has(name));
      this.note(
        t("{count} values of {name}", { count: found.length, name: file.name }) +
          (others.length ? t("; not known here: {names}", { names: others.slice(0, 5).join(", ") }) : ""),
      );
      await this.send();
    } catch (error) {
      this.note(`${file.name}: ${errorText(error)}`, true);
    }
  }
}

function limits({ type, min, max, usual, constants }) {
  const range =
    type === "int" || type === "double"
      ? t(" from {min} to {max},", { min: shownNumber(min), max: shownNumber(max) })
      : "";
  return `${constants.length ? t("enum of ") : ""}${type},${range} ${t("default {value}", { value: shownNumber(usual) })}`;
}

function makeTabs() {
  const bar = h("div", { class: "bar tabs", role: "tablist" });
  const pages = h("div", {});
  const choose = (chosen) => {
    [...bar.children].forEach((tab, index) => {
      tab.setAttribute("aria-selected", String(index === chosen));
      pages.children[index].hidden = index !== chosen;
    });
  };
  const add = (name, content) => {
    const index = bar.children.length;
    bar.append(h("button", { type: "button", role: "tab", onclick: () => choose(index) }, name));
    pages.append(h("div", { role: "tabpanel" }, content));
    choose(0);
  };
  return { element: h("div", { class: "group" }, bar, pages), add };
}

// --- controls: {element, show(value), enable(isEnabled), mark(isWaiting), flash()}

function makeControl(parameter, changed) {
  if (parameter.constants.length) return makeChoice(parameter, changed);
  if (parameter.type === "bool") return makeSwitch(parameter, changed);
  return makeField(parameter, changed);
}

function withState(element, inputs, show) {
  return {
    element,
    show(value, isTyped = false) {
      // What a person is typing or dragging stays.
      if (isTyped || !inputs.some((each) => each.dataset.isEdited)) show(value);
    },
    enable: (isEnabled) => {
      for (const each of inputs) each.disabled = !isEnabled;
    },
    mark: (isWaiting) => element.classList.toggle("waiting", isWaiting),
    flash: () => element.animate([{ background: "var(--warn-back)" }, { background: "transparent" }], 1500),
  };
}

function makeSwitch({ name }, changed) {
  const box = h("input", { type: "checkbox", "aria-label": name, onchange: () => changed(box.checked) });
  return withState(h("span", { class: "control" }, box), [box], (value) => {
    box.checked = value;
  });
}

function makeChoice({ name: parameterName, constants }, changed) {
  const select = h(
    "select",
    { "aria-label": parameterName, onchange: () => changed(constants[Number(select.value)].value) },
    constants.map(({ name, value, description }, index) =>
      h("option", { value: String(index), title: description }, `${name} (${shownNumber(value)})`),
    ),
  );
  const other = h("option", { value: "", hidden: true });
  select.append(other);
  return withState(h("span", { class: "control" }, select), [select], (value) => {
    const index = constants.findIndex((each) => each.value === value);
    select.value = index < 0 ? "" : String(index);
    setText(other, index < 0 ? String(value) : "");
  });
}

function makeField(parameter, changed) {
  const isText = parameter.type === "str";
  const step = isText ? null : sliderStep(parameter);
  const input = h("input", {
    type: "text",
    "aria-label": parameter.name,
    autocomplete: "off",
    inputmode: isText ? "text" : "decimal",
    oninput: () => {
      input.dataset.isEdited = "1";
    },
    onchange: () => finish(input.value),
    onkeydown: (event) => {
      if (event.key === "Escape") cancel();
    },
    onblur: () => {
      delete input.dataset.isEdited;
    },
  });
  let last = "";
  const cancel = () => {
    delete input.dataset.isEdited;
    input.value = last;
  };
  const finish = (text) => {
    delete input.dataset.isEdited;
    if (slider) delete slider.dataset.isEdited;
    changed(text);
  };
  const slider =
    step === null
      ? null
      : h("input", {
          type: "range",
          min: parameter.min,
          max: parameter.max,
          step: parameter.type === "int" ? 1 : "any",
          "aria-label": t("Slider of {name}", { name: parameter.name }),
          oninput: () => {
            slider.dataset.isEdited = "1";
            input.value = text();
          },
          onchange: () => finish(text()),
        });
  const text = () => {
    const value = Number(slider.value);
    const isEnd = value <= parameter.min || value >= parameter.max;
    return shownNumber(
      isEnd || parameter.type === "int" ? value : Number((Math.round(value / step) * step).toPrecision(12)),
    );
  };
  const element = h(
    "span",
    { class: `control${slider ? " sliding" : ""}${isText ? " text" : ""}` },
    slider
      ? [
          h("span", { class: "muted limit" }, shownNumber(parameter.min)),
          slider,
          h("span", { class: "muted limit" }, shownNumber(parameter.max)),
        ]
      : null,
    input,
  );
  return withState(element, slider ? [input, slider] : [input], (value) => {
    last = input.value = shownNumber(value);
    if (slider) slider.value = String(value);
  });
}
