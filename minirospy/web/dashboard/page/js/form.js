// A form for the fields of a type: what a person fills in becomes a message. Fields are those of the definition, so
// none can be mistyped.

import { h } from "./dom.js";
import { t } from "./texts.js";

const WHOLE = /^u?int(8|16|32|64)$|^byte$|^char$/;

export class MessageForm {
  constructor(definition) {
    this.fields = definition.fields.map((field) => makeField(field, definition.constants));
    this.element = h(
      "div",
      { class: "form" },
      this.fields.map((each) => each.element),
    );
    if (!this.fields.length) this.element.append(h("p", { class: "muted" }, "It has no fields."));
  }

  /** Return the message. Throws Error with the field's name. */
  value() {
    return Object.fromEntries(this.fields.map((each) => [each.name, each.value()]));
  }
}

function makeField(field, constants) {
  if (field.isArray) return arrayField(field);
  if (field.message) return nestedField(field);
  return plainField(field, WHOLE.test(field.type) ? constants.filter(({ type }) => WHOLE.test(type)) : []);
}

/** Return the constants whose names start with that of the field, as STATUS_FIX of status. */
function constantsOf(field, constants) {
  const prefix = `${field.name.toUpperCase()}_`;
  return constants.filter(({ name }) => name.startsWith(prefix));
}

function labelled(field, control) {
  const type = `${field.type}${field.isArray ? `[${field.length ?? ""}]` : ""}`;
  return h(
    "label",
    { class: "field" },
    h("span", { class: "key" }, field.name),
    control,
    h("span", { class: "muted kind" }, type),
  );
}

function plainField(field, constants) {
  const isBool = field.type === "bool";
  const control = h(
    "input",
    isBool
      ? { type: "checkbox", name: field.name }
      : {
          type: "text",
          name: field.name,
          inputmode: field.type === "string" ? "text" : "decimal",
          autocomplete: "off",
          value: field.type === "string" ? "" : "0",
        },
  );
  const offered = constantsOf(field, constants);
  const choice = offered.length
    ? h(
        "select",
        {
          "aria-label": t("Constants of {name}", { name: field.name }),
          onchange: () => {
            if (choice.value) control.value = choice.value;
          },
        },
        h("option", { value: "" }, "constant …"),
        offered.map(({ name, value }) => h("option", { value }, `${name.slice(field.name.length + 1)} = ${value}`)),
      )
    : null;
  const showChoice = () => {
    choice.value = offered.find(({ value, name }) => [value, name].includes(control.value.trim()))?.value ?? "";
  };
  if (choice) {
    control.addEventListener("input", showChoice);
    showChoice();
  }
  if (field.type === "time" || field.type === "duration")
    control.title = field.type === "time" ? t("Seconds, or now") : t("Seconds");
  // The name of any constant of the message is a value, too, as ARROW of Marker.
  const text = () => constants.find(({ name }) => name === control.value.trim())?.value ?? control.value;
  return {
    name: field.name,
    element: labelled(field, choice ? h("span", { class: "with-choice" }, control, choice) : control),
    value: () => (isBool ? control.checked : parsed(field.type, text(), field.name)),
  };
}

function nestedField(field) {
  const form = new MessageForm(field.message);
  const element = h(
    "fieldset",
    {},
    h("legend", {}, h("span", { class: "key" }, field.name), " ", h("span", { class: "muted" }, field.type)),
    form.element,
  );
  return { name: field.name, element, value: () => form.value() };
}

// Arrays as JSON: [1, 2], ["a"], [{"x": 1}].
function arrayField(field) {
  const example = field.message
    ? `[{"${field.message.fields[0]?.name ?? ""}": …}]`
    : field.type === "string"
      ? '["a", "b"]'
      : field.type === "bool"
        ? "[true, false]"
        : "[1, 2]";
  const control = h("input", {
    type: "text",
    name: field.name,
    autocomplete: "off",
    value: "[]",
    title: t("An array, as {example}", { example }),
  });
  const problem = () => new Error(t("{name}: write an array, as {example}", { name: field.name, example }));
  if (field.length !== null && !field.message)
    control.value = JSON.stringify(
      Array(field.length).fill(field.type === "string" ? "" : field.type === "bool" ? false : 0),
    );
  const value = () => {
    let found;
    try {
      found = JSON.parse(control.value.trim() || "[]");
    } catch {
      throw problem();
    }
    if (!Array.isArray(found)) throw problem();
    return found;
  };
  return { name: field.name, element: labelled(field, control), value };
}

function parsed(type, text, name) {
  if (type === "string") return text;
  const trimmed = text.trim();
  if (type === "time" || type === "duration") {
    if (type === "time" && trimmed === "now") {
      const now = Date.now();
      return { secs: Math.floor(now / 1000), nsecs: (now % 1000) * 1e6 };
    }
    const seconds = number(trimmed, name);
    const secs = Math.floor(seconds);
    return { secs, nsecs: Math.round((seconds - secs) * 1e9) };
  }
  if (!WHOLE.test(type)) return number(trimmed, name);
  if (!/^-?\d+$/.test(trimmed)) throw new Error(t('{name}: "{text}" is not a whole number', { name, text: trimmed }));
  const whole = BigInt(trimmed);
  const bits = type === "byte" || type === "char" ? 8 : Number(/\d+/.exec(type)[0]);
  const isSigned = type.startsWith("int") || type === "byte";
  if (whole !== (isSigned ? BigInt.asIntN : BigInt.asUintN)(bits, whole))
    throw new Error(t("{name}: {text} does not fit into {type}", { name, text: trimmed, type }));
  return bits === 64 ? whole : Number(whole);
}

function number(text, name) {
  const known = { nan: NaN, inf: Infinity, "-inf": -Infinity }[text.toLowerCase()];
  const found = known ?? Number(text);
  if (text === "" || (known === undefined && Number.isNaN(found)))
    throw new Error(t('{name}: "{text}" is not a number', { name, text }));
  return found;
}
