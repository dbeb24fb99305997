// Elements. Text of topics, nodes and log lines always goes in by textContent: it never becomes HTML.
// What a person reads on buttons, labels and in hints is translated here; texts with values in them, and those of
// setText, by t().

import { isList } from "./ros1.js";
import { codeParts, t } from "./texts.js";

const SPOKEN = new Set(["title", "aria-label", "placeholder", "label"]);
const WORDED = new Set(["button", "label", "option", "h2", "h3", "legend", "strong", "p", "summary"]);
const IS_PHRASE = /\p{Lu}|\S\s+\S/u; // a single word in lower case may be a name of the robot's
const SVG = "http://www.w3.org/2000/svg";

/** Return an element: h("button", {class: "x", onclick: f, title: "y"}, "text", child, ...). */
export function h(tag, properties = {}, ...children) {
  return filled(document.createElement(tag), properties, children);
}

/** Return an element of SVG. */
export function svg(tag, properties = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), properties, children);
}

function filled(element, properties, children) {
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "value" || name === "checked" || name === "inert") element[name] = value;
    else element.setAttribute(name, value === true ? "" : SPOKEN.has(name) ? t(value) : value);
  }
  append(element, children, WORDED.has(element.tagName.toLowerCase()));
  return element;
}

function append(element, children, isWorded = false) {
  for (const child of children.flat(Infinity)) {
    if (child === null || child === undefined || child === false) continue;
    element.append(
      child instanceof Node
        ? child
        : document.createTextNode(isWorded && IS_PHRASE.test(child) ? t(String(child)) : String(child)),
    );
  }
}

/** Return the parts of a name, which a browser may break behind "/" and "_" and not inside of words. */
export function breakable(name) {
  return String(name)
    .split(/(?<=[/_])(?=[^/_])/)
    .flatMap((part, index) => (index ? [h("wbr"), part] : [part]));
}

/** Return a text as children, with <code> for what is between backticks. */
export const withCode = (text) => codeParts(text).map(([part, isCode]) => (isCode ? h("code", {}, part) : part));

/** Replace what is in an element. */
export function fill(element, ...children) {
  waiting.delete(element);
  element.replaceChildren();
  append(element, children);
}

// A button that is replaced or moves away between press and release loses its click.
const PRESSABLE = "a, button, summary, label, input[type=checkbox], [role=button]";
const waiting = new Map(); // element -> what draws it
let pressed = null;
let press = null; // {element, x, y} of the last one, until its click

export const SLOP = 5; // pixels that a pointer may move in a click

/** Draw the contents of an element again for new data; if something in it is pressed, after its release. */
export function redraw(element, draw) {
  if (pressed && element.contains(pressed)) {
    waiting.set(element, draw);
    return;
  }
  waiting.delete(element);
  const focused = element.contains(document.activeElement) ? document.activeElement : null;
  const name = focused && identityOf(focused);
  draw();
  if (focused && !focused.isConnected)
    [...element.querySelectorAll(focused.tagName)]
      .find((each) => identityOf(each) === name)
      ?.focus({ preventScroll: true });
}

// What was focused, and its successor in the new drawing.
function identityOf(element) {
  return JSON.stringify([{ ...element.dataset }, element.getAttribute("aria-label") ?? element.textContent]);
}

/** Replace what is in an element, as redraw() does. */
export function refill(element, ...children) {
  redraw(element, () => fill(element, ...children));
}

function release() {
  pressed = null;
  if (waiting.size) setTimeout(drawWaiting); // the click comes first
}

function drawWaiting() {
  for (const [element, draw] of waiting) redraw(element, draw);
}

/** Notice what is pressed in a window, for redraw(). */
export function watchPresses(window) {
  window.addEventListener(
    "pointerdown",
    ({ target, button, clientX: x, clientY: y }) => {
      pressed = button === 0 ? target.closest(PRESSABLE) : null;
      press = pressed && { element: pressed, x, y };
    },
    true,
  );
  // A list of choices or another window may take the release.
  window.addEventListener(
    "pointermove",
    ({ buttons }) => {
      if (pressed && !buttons) release();
    },
    true,
  );
  for (const name of ["pointerup", "pointercancel"]) window.addEventListener(name, release, true);
  // Elements lose the focus, too: the one before loses it to what is pressed.
  window.addEventListener(
    "blur",
    ({ target }) => {
      if (target === window) release();
    },
    true,
  );
  window.addEventListener("click", resend, true);
}

/**
 * Give a click to what was pressed: if that has moved away since, what is around it and the place of the release has
 * got it.
 */
function resend(event) {
  const { element, x, y } = press ?? {};
  press = null;
  if (
    !element?.isConnected ||
    !event.isTrusted ||
    event.composedPath().includes(element) ||
    !event.target.contains(element)
  )
    return;
  if (Math.hypot(event.clientX - x, event.clientY - y) > SLOP) return;
  event.preventDefault();
  event.stopPropagation();
  const { clientX, clientY, detail, ctrlKey, shiftKey, altKey, metaKey } = event;
  element.dispatchEvent(
    new MouseEvent("click", {
      bubbles: true,
      cancelable: true,
      view: window,
      clientX,
      clientY,
      detail,
      ctrlKey,
      shiftKey,
      altKey,
      metaKey,
    }),
  );
}

let uniqueIds = 0;

/** Return an id that no element has: the name itself if it is free, as a layout may show a view twice. */
export function uniqueId(name) {
  return document.getElementById(name) ? `${name}-${++uniqueIds}` : name;
}

/** Set an element's text if it differs. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Return a value as JSON that YAML reads, too; no letter of its texts turns the direction of what is around it. */
export function quoted(value) {
  return JSON.stringify(value).replace(
    /[\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]/g,
    (each) => `\\u${each.charCodeAt(0).toString(16).padStart(4, "0")}`,
  );
}

/** Return a value as one line of text for people; long arrays are cut. */
export function shown(value, most = 120) {
  let text;
  if (typeof value === "string") text = value;
  else if (typeof value === "number") text = number(value);
  else if (isList(value)) {
    const some = Array.from({ length: Math.min(value.length, 12) }, (_, index) => shown(value[index], 20));
    text = `[${some.join(", ")}${value.length > some.length ? ", …" : ""}] (${value.length})`;
  } else if (value !== null && typeof value === "object") {
    text = `{${Object.entries(value)
      .map(([name, each]) => `${name}: ${shown(each, 30)}`)
      .join(", ")}}`;
  } else text = String(value);
  return text.length > most ? `${text.slice(0, most - 1)}…` : text;
}

/** Return a number with seven digits at most. */
export function number(value) {
  if (Number.isInteger(value) || !Number.isFinite(value)) return String(value);
  return String(Number(value.toPrecision(7)));
}

/** Return bytes a second for people. */
export function bandwidth(bytes) {
  if (bytes < 1000) return `${bytes.toFixed(0)} B/s`;
  if (bytes < 1e6) return `${(bytes / 1e3).toFixed(1)} kB/s`;
  return `${(bytes / 1e6).toFixed(1)} MB/s`;
}

/** Offer a file to be saved. */
export function download(name, blob) {
  const url = URL.createObjectURL(blob);
  h("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}
