// Several views on one page: panes in rows and columns, resized at their dividers, docked by dragging their heads.

import { addressOf, wordsOf } from "./address.js";
import { fill, h, setText, svg } from "./dom.js";
import { sideAt } from "./layout.js";
import { t } from "./texts.js";

const DRAG_PIXELS = 6; // less is a click
const EDGE_PIXELS = 18; // of the whole layout, if a pane is docked beside all others
const LEAST_REM = 14; // height of a pane, so that it shows something: with many of them the page scrolls
const ICONS = {
  right: "M2 3h12v10H2zM8 3v10",
  bottom: "M2 3h12v10H2zM2 8h12",
  largest: "M2 6V3h4M10 3h4v3M14 10v3h-4M6 13H2v-3",
  close: "M4 4l8 8M12 4l-8 8",
};
const STEP = 0.05; // of a divider that is moved by keys

/** Return how many panes are one below another. */
const rowsOf = (node) =>
  node.kind === "pane" ? 1 : node.parts.map(rowsOf).reduce((a, b) => (node.kind === "row" ? Math.max(a, b) : a + b));

export class Dock {
  /** views: name -> [title, class]; changed() is called when the layout or a view's settings have changed. */
  constructor(link, layout, views, changed) {
    this.link = link;
    this.layout = layout;
    this.views = views;
    this.changed = changed;
    this.panes = new Map(); // id -> {element, body, view, ...}
    this.active = null; // the id of the pane that keys go to
    this.largest = null; // the id of the pane that has all of the space
    this.mark = h("div", { class: "drop", hidden: true });
    this.element = h("div", { class: "dock", onclick: (event) => this.follow(event) });
    this.draw();
  }

  close() {
    for (const pane of this.panes.values()) this.closeView(pane);
    this.panes.clear();
  }

  /** Close the view of a pane; what fails there is not that of others. */
  closeView(pane) {
    const { view } = pane;
    pane.view = null;
    try {
      view?.close();
    } catch (error) {
      reportError(error);
    }
  }

  /** Show another layout. */
  show(layout) {
    this.close();
    this.layout = layout;
    this.active = this.largest = null;
    this.draw();
  }

  // --- what there is

  draw() {
    const focused = document.activeElement;
    const wanted = this.layout.panes();
    const ids = new Set(wanted.map((node) => node.id));
    for (const [id, pane] of this.panes) {
      if (ids.has(id)) continue;
      this.closeView(pane);
      pane.element.remove();
      this.panes.delete(id);
    }
    if (!ids.has(this.largest)) this.largest = null;
    if (!ids.has(this.active)) this.active = wanted[0]?.id ?? null;
    // A view may measure its place when it is made, so its pane is in the page then.
    for (const node of wanted) if (!this.panes.has(node.id)) this.panes.set(node.id, this.makePane(node));
    fill(this.element, this.layout.root ? this.box(this.layout.root) : null, this.mark);
    for (const node of wanted) this.open(node);
    this.showActive();
    if (focused instanceof HTMLElement && this.element.contains(focused)) focused.focus({ preventScroll: true });
  }

  box(node) {
    const element = node.kind === "pane" ? this.panes.get(node.id).element : h("div", { class: `box ${node.kind}` });
    element.style.flexGrow = String(node.weight);
    if (node.kind === "pane") return element;
    // Shares of less than 1 in sum would leave space: those of flex-grow are of 1.
    const total = node.parts.reduce((sum, part) => sum + part.weight, 0);
    node.parts.forEach((part, index) => {
      if (index) element.append(this.divider(node, index - 1));
      const child = this.box(part);
      child.style.flexGrow = String((part.weight / total) * 100);
      element.append(child);
    });
    return element;
  }

  makePane(node) {
    const choice = h("select", {
      class: "pane-view",
      "aria-label": t("View of this pane"),
      onchange: () => this.replace(node, choice.value),
    });
    for (const [name, [title]] of Object.entries(this.views)) choice.append(h("option", { value: name }, t(title)));
    if (!Object.hasOwn(this.views, node.view)) choice.append(h("option", { value: node.view }, node.view));
    choice.value = node.view;
    const button = (label, icon, react) =>
      h(
        "button",
        { type: "button", title: label, "aria-label": label, onclick: react },
        svg("svg", { class: "icon", viewBox: "0 0 16 16", "aria-hidden": "true" }, svg("path", { d: ICONS[icon] })),
      );
    const handle = h(
      "span",
      {
        class: "pane-grip",
        tabindex: 0,
        role: "button",
        "aria-label": t("Move this pane: arrow keys, or drag"),
        title: t("Drag to move"),
        onkeydown: (event) => this.moveByKey(event, node),
      },
      "⠿",
    );
    const largest = button(t("Maximise"), "largest", () => this.maximise(node));
    const head = h(
      "div",
      {
        class: "pane-head",
        ondblclick: (event) => {
          if (event.target === head) this.maximise(node);
        },
      },
      handle,
      choice,
      h("span", { class: "pane-about" }),
      button(t("Split: another view to the right"), "right", () => this.split(node, "right")),
      button(t("Split: another view below"), "bottom", () => this.split(node, "bottom")),
      largest,
      button(t("Close this pane"), "close", () => this.remove(node)),
    );
    const body = h("div", { class: "pane-body view" });
    const element = h(
      "section",
      { class: "pane", onpointerdown: () => this.activate(node.id), onfocusin: () => this.activate(node.id) },
      head,
      body,
    );
    element.dataset.pane = node.id;
    this.dragBy(head, node);
    return { element, head, body, choice, largest, view: null };
  }

  /** Make the view of a pane, once. */
  open(node) {
    const pane = this.panes.get(node.id);
    if (pane.view && pane.body.dataset.view === node.view) return;
    this.closeView(pane);
    fill(pane.body);
    pane.body.dataset.view = node.view;
    const [title, View] = Object.hasOwn(this.views, node.view) ? this.views[node.view] : [node.view, Unknown];
    pane.element.setAttribute("aria-label", t(title));
    setText(pane.head.querySelector(".pane-about"), about(node));
    const place = {
      views: this.views,
      isActive: () => this.active === node.id,
      remember: (words) => {
        node.words = wordsOf(words).toString();
        setText(pane.head.querySelector(".pane-about"), about(node));
        this.changed();
      },
      open: (view, words) => this.reach(view, wordsOf(words), node),
    };
    try {
      pane.view = new View(this.link, new URLSearchParams(node.words), pane.body, place);
    } catch (error) {
      reportError(error);
      pane.view = new Failed(pane.body, error);
    }
  }

  activate(id) {
    if (this.active === id) return;
    this.active = id;
    this.showActive();
  }

  showActive() {
    this.element.style.minHeight =
      this.layout.root && this.largest === null ? `${LEAST_REM * rowsOf(this.layout.root)}rem` : "";
    for (const [id, { element, largest }] of this.panes) {
      element.classList.toggle("active", id === this.active);
      element.classList.toggle("largest", id === this.largest);
      element.inert = this.largest !== null && id !== this.largest;
      largest.setAttribute("aria-pressed", String(id === this.largest));
    }
  }

  // --- what a person does

  /** Add a view at the right of the active pane; return whether there was room. */
  add(view, words = "", side = "right", beside = this.layout.find(this.active)) {
    const node = this.layout.add(view, words, side, beside);
    if (!node) return false;
    this.largest = null;
    this.draw();
    this.changed();
    this.reveal(node);
    return true;
  }

  reveal(node) {
    const { element, choice } = this.panes.get(node.id);
    element.scrollIntoView({ block: "nearest" });
    choice.focus({ preventScroll: true });
    this.activate(node.id);
  }

  split(node, side) {
    this.add(node.view, "", side, node);
  }

  remove(node) {
    this.layout.remove(node);
    this.draw();
    this.changed();
  }

  replace(node, view) {
    node.view = view;
    node.words = "";
    this.draw();
    this.changed();
  }

  maximise(node) {
    this.largest = this.largest === node.id ? null : node.id;
    this.active = node.id;
    this.showActive();
  }

  move(node, side, target) {
    this.layout.move(node, side, target);
    this.draw();
    this.changed();
  }

  moveByKey(event, node) {
    const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
    const all = this.layout.panes();
    const other = all[all.indexOf(node) + step];
    if (!other) return;
    event.preventDefault();
    this.move(node, "center", other);
  }

  /**
   * Follow a link of a view inside of the layout: a view that is shown takes it over, else it gets a pane of its own.
   */
  follow(event) {
    const anchor = event.target.closest?.('a[href^="#/"]');
    if (!anchor || event.ctrlKey || event.metaKey || event.shiftKey || event.button) return;
    const { view, words } = addressOf(anchor.getAttribute("href"));
    if (!Object.hasOwn(this.views, view)) return;
    event.preventDefault();
    const source = this.layout.find(Number(anchor.closest(".pane")?.dataset.pane));
    this.reach(view, words, source);
  }

  reach(view, words, source) {
    for (const node of this.layout.panes()) {
      const pane = this.panes.get(node.id);
      if (node.view !== view || node === source || !pane.view?.accept?.(words)) continue;
      this.reveal(node);
      return;
    }
    this.add(view, words.toString(), "right", source ?? undefined);
  }

  // --- dividers

  divider(split, index) {
    const isRow = split.kind === "row";
    const element = h("div", {
      class: "divider",
      role: "separator",
      tabindex: 0,
      "aria-orientation": isRow ? "vertical" : "horizontal",
      "aria-label": t("Divider: arrow keys, or drag"),
      "aria-valuemin": 5,
      "aria-valuemax": 95,
    });
    const share = () => split.parts[index].weight / (split.parts[index].weight + split.parts[index + 1].weight);
    const resize = (wanted) => {
      this.layout.resize(split, index, wanted);
      const total = split.parts.reduce((sum, part) => sum + part.weight, 0);
      [element.previousSibling, element.nextSibling].forEach((each, offset) => {
        each.style.flexGrow = String((split.parts[index + offset].weight / total) * 100);
      });
      element.setAttribute("aria-valuenow", String(Math.round(share() * 100)));
    };
    element.setAttribute("aria-valuenow", String(Math.round(share() * 100)));
    element.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      element.setPointerCapture(event.pointerId);
      element.classList.add("dragged");
    });
    element.addEventListener("pointermove", (event) => {
      if (!element.classList.contains("dragged")) return;
      const [one, other] = [element.previousSibling, element.nextSibling].map((each) => each.getBoundingClientRect());
      resize(
        isRow
          ? (event.clientX - one.left) / (other.right - one.left)
          : (event.clientY - one.top) / (other.bottom - one.top),
      );
    });
    for (const name of ["pointerup", "pointercancel"]) {
      element.addEventListener(name, () => {
        if (element.classList.contains("dragged")) {
          element.classList.remove("dragged");
          this.changed();
        }
      });
    }
    element.addEventListener("dblclick", () => {
      resize(0.5);
      this.changed();
    });
    element.addEventListener("keydown", (event) => {
      const step = (isRow ? { ArrowLeft: -STEP, ArrowRight: STEP } : { ArrowUp: -STEP, ArrowDown: STEP })[event.key];
      if (!step) return;
      event.preventDefault();
      resize(share() + step);
      this.changed();
    });
    return element;
  }

  // --- docking by dragging a head

  dragBy(head, node) {
    let start = null;
    let target = null;
    head.addEventListener("pointerdown", (event) => {
      if (event.button || event.target.closest("button, select, input")) return;
      start = event;
      target = null;
      head.setPointerCapture(event.pointerId);
    });
    head.addEventListener("pointermove", (event) => {
      if (!start || (!target && Math.hypot(event.clientX - start.clientX, event.clientY - start.clientY) < DRAG_PIXELS))
        return;
      target = this.placeAt(event.clientX, event.clientY, node);
      head.closest(".pane").classList.add("dragged");
      this.showMark(target);
    });
    const end = (isDropped) => {
      if (!start) return;
      start = null;
      head.closest(".pane").classList.remove("dragged");
      this.mark.hidden = true;
      if (isDropped && target?.side) this.move(node, target.side, target.node);
    };
    head.addEventListener("pointerup", () => end(true));
    head.addEventListener("pointercancel", () => end(false));
    head.addEventListener("keydown", (event) => {
      if (event.key === "Escape") end(false);
    });
  }

  /** Return where a pane would be docked: {side, node, box}; node is null for a side of the whole layout. */
  placeAt(x, y, moved) {
    const whole = this.element.getBoundingClientRect();
    const edges = { left: x - whole.left, right: whole.right - x, top: y - whole.top, bottom: whole.bottom - y };
    const [edge, distance] = Object.entries(edges).sort((one, other) => one[1] - other[1])[0];
    if (distance < EDGE_PIXELS) return { side: edge, node: null, box: whole };
    for (const [id, { element }] of this.panes) {
      const box = element.getBoundingClientRect();
      if (x < box.left || x > box.right || y < box.top || y > box.bottom) continue;
      if (id === moved.id) break;
      return { side: sideAt((x - box.left) / box.width, (y - box.top) / box.height), node: this.layout.find(id), box };
    }
    return { side: null };
  }

  showMark({ side, box }) {
    this.mark.hidden = !side;
    if (!side) return;
    const whole = this.element.getBoundingClientRect();
    const isWide = side === "top" || side === "bottom" || side === "center";
    const isTall = side === "left" || side === "right" || side === "center";
    Object.assign(this.mark.style, {
      left: `${box.left - whole.left + (side === "right" ? box.width / 2 : 0)}px`,
      top: `${box.top - whole.top + this.element.scrollTop + (side === "bottom" ? box.height / 2 : 0)}px`,
      width: `${isWide ? box.width : box.width / 2}px`,
      height: `${isTall ? box.height : box.height / 2}px`,
    });
  }
}

/** Return what a pane shows, for its head: the values of its settings. */
function about(node) {
  return [...new URLSearchParams(node.words).values()].filter((each) => each.startsWith("/")).join(" ");
}

class Failed {
  constructor(main, error) {
    main.append(h("p", { class: "error", role: "alert" }, t("This view failed: {why}", { why: error.message })));
  }

  close() {}
}

class Unknown {
  constructor(link, words, main) {
    main.append(h("p", { class: "empty" }, t("This page has no such view.")));
  }

  close() {}
}
