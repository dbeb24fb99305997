// The palette (Ctrl-K): finds views, layouts, topics, services and nodes by typing.

import { fragmentOf } from "./address.js";
import { fill, h } from "./dom.js";
import { t } from "./texts.js";

const MAX_SHOWN = 30;

/**
 * Return what can be opened: {label, kind, fragment}. views: name -> [title, ...]; graph and channels are the link's.
 */
export function entriesOf(views, layouts, { channels, services, graph }) {
  const entries = Object.entries(views).map(([name, [title]]) => ({
    label: t(title),
    other: title,
    kind: t("view"),
    fragment: fragmentOf(name, {}),
  }));
  const add = (kind, names, fragment) => {
    for (const name of [...names].sort())
      entries.push({ label: name, other: "", kind: t(kind), fragment: fragment(name) });
  };
  add("layout", layouts, (preset) => fragmentOf("layout", { preset }));
  add("topic", channels.keys(), (open) => fragmentOf("topics", { open }));
  add("service", services.keys(), (service) => fragmentOf("services", { service }));
  const nodes = new Set();
  for (const table of [graph.published, graph.subscribed, graph.services])
    for (const owners of table.values()) for (const node of owners) nodes.add(node);
  add("node", nodes, (node) => fragmentOf("nodes", { node }));
  return entries;
}

/** Return the entries that contain all words of a text, those that begin with it first. */
export function matching(entries, text) {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  const rankOf = ({ label, other, kind }) => {
    const [name, full] = [label.toLowerCase(), `${label} ${other} ${kind}`.toLowerCase()];
    if (!words.every((word) => full.includes(word))) return -1;
    if (!words.length || name.startsWith(words[0]) || other.toLowerCase().startsWith(words[0])) return 0;
    return name.split(/[/_ ]/).some((part) => part.startsWith(words[0])) ? 1 : 2;
  };
  return entries
    .map((entry) => ({ entry, rank: rankOf(entry) }))
    .filter(({ rank }) => rank >= 0)
    .sort((a, b) => a.rank - b.rank)
    .slice(0, MAX_SHOWN)
    .map(({ entry }) => entry);
}

/** Open the palette, or close it if it is open; entries() returns what can be opened, go(fragment) opens it. */
export function openPalette(entries, go) {
  /** @type {HTMLDialogElement | null} */
  const known = document.querySelector("dialog.palette");
  if (known) return known.close();
  const all = entries();
  let found = [];
  let chosen = 0;
  const list = h("ul", { role: "listbox", id: "palette-list", "aria-label": "Matches" });
  const search = h("input", {
    type: "search",
    placeholder: "View, topic, service or node",
    "aria-label": "View, topic, service or node",
    role: "combobox",
    "aria-expanded": "true",
    "aria-controls": "palette-list",
    autocomplete: "off",
    oninput: () => show(0),
    onkeydown: (event) => {
      const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      if (step) show((chosen + step + found.length) % Math.max(1, found.length));
      else if (event.key === "Enter" && found.length) open(found[chosen]);
      else if (event.key === "Escape")
        dialog.close(); // at once: by itself, it first clears the text
      else return;
      event.preventDefault();
    },
  });
  const dialog = h(
    "dialog",
    { class: "palette panel", "aria-label": "Find", onclose: () => dialog.remove() },
    search,
    list,
  );
  const open = ({ fragment }) => {
    dialog.close();
    go(fragment);
  };
  const show = (index) => {
    found = matching(all, search.value);
    chosen = index;
    fill(
      list,
      found.map((each, number) =>
        h(
          "li",
          {
            id: `palette-${number}`,
            role: "option",
            "aria-selected": String(number === chosen),
            onclick: () => open(each),
          },
          h("span", {}, each.label),
          h("span", { class: "kind" }, each.kind),
        ),
      ),
    );
    if (!found.length) list.append(h("li", { class: "none" }, t("Nothing has this name.")));
    search.setAttribute("aria-activedescendant", found.length ? `palette-${chosen}` : "");
    list.children[chosen]?.scrollIntoView({ block: "nearest" });
  };
  document.body.append(dialog);
  dialog.showModal();
  show(0);
  search.focus();
}
