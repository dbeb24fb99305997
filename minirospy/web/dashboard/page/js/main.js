// The shell: views by the fragment of the address (#/plot?path=/a/b), the state of the connection, dark and light.

import { addressOf, fragmentOf } from "./address.js";
import { listenForKeys, openHelp } from "./help.js";
import { entriesOf, openPalette } from "./palette.js";
import { PRESETS } from "./presets.js";
import { LANGUAGES, chooseLanguage, language, t } from "./texts.js";
import { Link } from "./link.js";
import { fill, h, setText, watchPresses } from "./dom.js";
import { Actions } from "./views/actions.js";
import { Bag } from "./views/bag.js";
import { Board } from "./views/board.js";
import { Class } from "./views/class.js";
import { Console } from "./views/console.js";
import { Controllers } from "./views/controllers.js";
import { Diagnostics } from "./views/diagnostics.js";
import { Graph } from "./views/graph.js";
import { Image } from "./views/image.js";
import { Joints } from "./views/joints.js";
import { Launch } from "./views/launch.js";
import { Layouts } from "./views/layout.js";
import { Nodes } from "./views/nodes.js";
import { Overview } from "./views/overview.js";
import { Parameters } from "./views/parameters.js";
import { Panels } from "./views/panels.js";
import { Plot } from "./views/plot.js";
import { Publish } from "./views/publish.js";
import { Reconfigure } from "./views/reconfigure.js";
import { Scene } from "./views/scene.js";
import { Services } from "./views/services.js";
import { Simulation } from "./views/simulation.js";
import { Smach } from "./views/smach.js";
import { Teleop } from "./views/teleop.js";
import { Tf } from "./views/tf.js";
import { Topics } from "./views/topics.js";
import { Trajectory } from "./views/trajectory.js";
import { Turtlesim } from "./views/turtlesim.js";

if (window.parent !== window) document.documentElement.classList.add("embedded");

const VIEWS = {
  overview: ["Overview", Overview, "Look"],
  topics: ["Topics", Topics, "Look"],
  console: ["Console", Console, "Look"],
  plot: ["Plot", Plot, "Look"],
  graph: ["Graph", Graph, "Look"],
  image: ["Image", Image, "Look"],
  "3d": ["3D", Scene, "Look"],
  simulation: ["Simulation", Simulation, "Drive"],
  tf: ["Frames", Tf, "Look"],
  board: ["Board", Board, "System"],
  turtlesim: ["Turtlesim", Turtlesim, "Drive"],
  teleop: ["Teleop", Teleop, "Drive"],
  publish: ["Publish", Publish, "Drive"],
  services: ["Services", Services, "Drive"],
  actions: ["Actions", Actions, "Drive"],
  parameters: ["Parameters", Parameters, "System"],
  reconfigure: ["Reconfigure", Reconfigure, "System"],
  nodes: ["Nodes", Nodes, "System"],
  launch: ["Launch", Launch, "Files"],
  bag: ["Bags", Bag, "Files"],
  joints: ["Joints", Joints, "Drive"],
  controllers: ["Controllers", Controllers, "Drive"],
  trajectory: ["Trajectory", Trajectory, "Drive"],
  smach: ["State machines", Smach, "System"],
  diagnostics: ["Diagnostics", Diagnostics, "Look"],
  class: ["Class", Class, "System"],
  panels: ["Panels", Panels, "Look"],
  layout: ["Layouts", Layouts, "Look"],
};
const GROUPS = ["Look", "Drive", "System", "Files"];
const STATES = {
  connecting: "connecting …",
  open: "connected",
  lost: "connection lost, trying again …",
  refused: "no connection, trying again …",
};

const TOKEN_ADVICE =
  "Open the link that the command has printed: it contains the token. `minirospy bridge --show-tokens` prints it, too.";

const token = await takeToken();
const link = new Link(token);
const tabs = document.getElementById("tabs");
const main = document.getElementById("view");
const notices = document.getElementById("notices");
const viewOf = (/** @type {any} */ tab) => tab.dataset.view;
const groupOf = (/** @type {any} */ group) => group.dataset.group;
const keyOf = (/** @type {any} */ notice) => notice.dataset.key;
let current = null;
let shown = null; // the place of the current view

/**
 * Return the token of the address, or of its code, which is kept for this tab, and removed from the address and the
 * history.
 */
async function takeToken() {
  const { view, words } = addressOf(location.hash);
  const code = words.get("code");
  let given = words.get("token");
  if (given || code) {
    for (const name of ["token", "code"]) words.delete(name);
    history.replaceState(null, "", fragmentOf(view, words));
  }
  if (code) {
    const answer = await fetch("token", { headers: { authorization: `Bearer ${code}` } }).catch(() => null);
    if (answer?.ok) given = await answer.text();
  }
  if (given) sessionStorage.setItem("token", given);
  return sessionStorage.getItem("token") ?? "";
}

/**
 * Return what a view may use of the page: where its settings are kept, other views, whether keys are for it. In a
 * layout a pane gives its own.
 */
function placeOf(name) {
  const place = {
    views: VIEWS,
    isActive: () => true,
    /** Keep the view's settings in the address; as an object, or URLSearchParams. */
    remember: (words) => {
      if (place === shown) history.replaceState(null, "", fragmentOf(name, words));
    },
    /** Show a view with these settings. */
    open: (view, words) => {
      location.hash = fragmentOf(view, words);
    },
  };
  return place;
}

function route() {
  const { view, words } = addressOf(location.hash);
  const chosen = Object.hasOwn(VIEWS, view) ? view : "overview";
  // What fails in one view does not keep a person in it.
  const closing = current;
  current = null;
  try {
    closing?.close();
  } catch (error) {
    reportError(error);
  }
  const [title, View] = VIEWS[chosen];
  main.dataset.view = chosen;
  fill(main);
  shown = placeOf(chosen);
  current = new View(link, words, main, shown);
  document.title = `${t(title)} · minirospy`;
  setText(document.getElementById("title"), t(title));
  showTabs();
}

/** Name the groups of views and the views; the current view's group has its name, too. */
function showTabs() {
  for (const group of tabs.children) {
    const [button, menu] = group.children;
    let name = t(groupOf(group));
    for (const tab of menu.children) {
      const title = t(VIEWS[viewOf(tab)][0]);
      setText(tab, title);
      if (viewOf(tab) === main.dataset.view) {
        tab.setAttribute("aria-current", "page");
        name += ` · ${title}`;
      } else tab.removeAttribute("aria-current");
    }
    setText(button, name);
    button.classList.toggle("current", Boolean(menu.querySelector("[aria-current]")));
  }
}

/** Return a group of views: a button, and the menu that opens while the pointer or the focus is on it. */
function makeGroup(name) {
  const views = Object.entries(VIEWS).filter(([, [, , group]]) => group === name);
  const group = h(
    "div",
    { class: "views", onmouseleave: () => group.classList.remove("closed") },
    h("button", { type: "button", "aria-haspopup": "true", onclick: () => group.classList.remove("closed") }, name),
    h(
      "div",
      { class: "menu" },
      views.map(([view, [title]]) => h("a", { href: `#/${view}`, "data-view": view }, title)),
    ),
  );
  group.dataset.group = name;
  group.addEventListener("click", ({ target }) => {
    if (target instanceof HTMLAnchorElement) close();
  });
  group.addEventListener("keydown", ({ key }) => {
    if (key === "Escape") close();
  });
  const close = () => {
    group.classList.add("closed");
    if (group.contains(document.activeElement)) /** @type {HTMLElement} */ (document.activeElement).blur();
  };
  return group;
}

/** Open the palette, or close it. */
function find() {
  const layouts = Object.keys(PRESETS);
  openPalette(
    () => entriesOf(VIEWS, layouts, link),
    (fragment) => {
      location.hash = fragment;
    },
  );
}

function showState() {
  const element = document.getElementById("state");
  setText(element, t(STATES[link.state]) + (link.state === "open" && !link.mayWrite ? t(", read-only") : ""));
  element.dataset.state = link.state;
}

/** Show why the server refuses the page, as long as it does. */
async function showRefusal() {
  const isRefused = link.state === "refused" || link.state === "lost";
  const found = isRefused ? await link.refusal() : null;
  if (!found) return link.emit("withdrawn", ["refusal"]);
  const advice = found.status === 401 ? ` ${t(TOKEN_ADVICE)}` : "";
  showNotice({ message: `${t(found.text)}.${advice}`, level: 2, id: "refusal" });
}

function showNotice({ message, level = 1, id = null }) {
  const key = id ?? message;
  const known = [...notices.children].find((each) => keyOf(each) === key);
  const notice = h(
    "div",
    { class: `notice level${level}` },
    h("span", {}, message),
    h("button", { type: "button", title: "Dismiss", onclick: () => notice.remove() }, "×"),
  );
  notice.dataset.key = key;
  if (known) known.replaceWith(notice);
  else notices.append(notice);
  while (notices.children.length > 4) notices.firstChild.remove();
}

function switchTheme() {
  const isDark = document.documentElement.dataset.theme
    ? document.documentElement.dataset.theme === "dark"
    : matchMedia("(prefers-color-scheme: dark)").matches;
  document.documentElement.dataset.theme = isDark ? "light" : "dark";
  localStorage.setItem("theme", document.documentElement.dataset.theme);
  link.emit("theme");
}

/** Show the page in the language that was chosen, else the browser's. */
function showLanguage() {
  chooseLanguage(localStorage.getItem("language"), navigator.languages);
  document.documentElement.lang = language;
  const others = Object.keys(LANGUAGES).filter((each) => each !== language);
  const button = document.getElementById("language");
  setText(button, others[0].toUpperCase());
  button.lang = others[0];
  button.title = LANGUAGES[others[0]];
  button.setAttribute("aria-label", `${others[0].toUpperCase()}: ${LANGUAGES[others[0]]}`);
  for (const [id, title] of [
    ["find", "Find a view, topic, service or node (Ctrl-K)"],
    ["theme", "Dark or light"],
    ["help", "Keys"],
  ]) {
    const element = document.getElementById(id);
    element.title = t(title);
    element.setAttribute("aria-label", t(title));
  }
  setText(document.getElementById("skip"), t("To the view"));
  tabs.setAttribute("aria-label", t("Views"));
  showTabs();
}

function switchLanguage() {
  localStorage.setItem(
    "language",
    Object.keys(LANGUAGES).find((each) => each !== language),
  );
  showLanguage();
  showState();
  route();
}

/** Show the view before (-1) or after (1) this one. */
function step(by) {
  const names = Object.keys(VIEWS);
  location.hash = fragmentOf(names[(names.indexOf(main.dataset.view) + by + names.length) % names.length], {});
}

if (localStorage.getItem("theme")) document.documentElement.dataset.theme = localStorage.getItem("theme");
watchPresses(window);
document.getElementById("theme").addEventListener("click", switchTheme);
document.getElementById("language").addEventListener("click", switchLanguage);
document.getElementById("help").addEventListener("click", openHelp);
document.getElementById("find").addEventListener("click", find);
document.getElementById("skip").addEventListener("click", () => main.focus());
listenForKeys(step, find);
tabs.append(...GROUPS.map(makeGroup));
showLanguage();
link.watch(["state"], showState);
link.watch(["state"], showRefusal);
link.addEventListener("notice", (/** @type {any} */ { detail }) => showNotice(detail));
link.addEventListener("withdrawn", (/** @type {any} */ { detail }) => {
  for (const notice of [...notices.children]) if (detail.includes(keyOf(notice))) notice.remove();
});
addEventListener("hashchange", route);
route();
