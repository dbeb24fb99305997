// The keys of the page: what they do, and the list of them that "?" opens.

import { fill, h } from "./dom.js";
import { t } from "./texts.js";

const KEYS = [
  ["?", "This list"],
  [", .", "The view before and after this one"],
  ["/", "To the filter of the view"],
  ["Ctrl K", "Find a view, topic, service or node"],
  ["Tab, Enter, Space", "To the next button or field, and press it"],
  ["← ↑ ↓ →  W A S D", "Teleop: drive while they are held"],
  ["1 2", "Board: press its buttons while they are held"],
  ["← ↑ ↓ →", "Layouts: move a pane (its dots) or a divider; Board: move the person"],
  ["← →  + −  Escape", "Plot, with the focus on the chart: pan, zoom, follow"],
  ["M C N P G U", "3D: the tools, in the order of their buttons"],
  ["Space  ← →  Home End", "Bags: play and pause, step, go to the start and the end"],
  ["Escape", "Close what is open"],
];

const isTyping = (element) =>
  /INPUT|SELECT|TEXTAREA/.test(element?.tagName ?? "") && !/^(checkbox|radio|range|color)$/.test(element.type);

/** Open the list of keys. */
export function openHelp() {
  /** @type {HTMLDialogElement | null} */
  const known = document.querySelector("dialog.help");
  if (known) {
    known.close();
    return;
  }
  const dialog = h("dialog", { class: "help panel", "aria-labelledby": "help-title", onclose: () => dialog.remove() });
  fill(
    dialog,
    h("h2", { id: "help-title" }, "Keys"),
    h(
      "table",
      {},
      h(
        "tbody",
        {},
        KEYS.map(([keys, what]) => h("tr", {}, h("th", { scope: "row" }, h("kbd", {}, keys)), h("td", {}, t(what)))),
      ),
    ),
    h("button", { type: "button", class: "primary", onclick: () => dialog.close() }, "Close"),
  );
  document.body.append(dialog);
  dialog.showModal();
}

/** Listen for the keys of the whole page; step(1 or -1) shows another view, find() opens the palette. */
export function listenForKeys(step, find) {
  const react = {
    "?": openHelp,
    ",": () => step(-1),
    ".": () => step(1),
    "/": () => {
      const within = document.querySelector(".pane.active") ?? document.getElementById("view");
      /** @type {HTMLElement | null} */
      const search = within.querySelector("input[type=search], input:not([type]), input[type=text]");
      search?.focus();
    },
  };
  addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && !event.altKey && event.key.toLowerCase() === "k") {
      event.preventDefault();
      find();
      return;
    }
    if (
      !Object.hasOwn(react, event.key) ||
      event.ctrlKey ||
      event.altKey ||
      event.metaKey ||
      isTyping(document.activeElement)
    )
      return;
    event.preventDefault();
    react[event.key]();
  });
}
