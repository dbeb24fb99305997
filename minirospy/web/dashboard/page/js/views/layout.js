// Several views side by side: presets, saved layouts, files, links.

import { Dock } from "../dock.js";
import { download, fill, h, setText } from "../dom.js";
import { Layout, MAX_PANES } from "../layout.js";
import { PRESETS, classroom } from "../presets.js";
import { t } from "../texts.js";

const KEY = "layouts"; // of localStorage: {name: text}
const FILE = "minirospy layout"; // what a file says of itself
const MAX_FILE = 100_000; // bytes
const WAIT_MS = 3000; // for the names of boards

export class Layouts {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.name = words.get("name") ?? "";
    // A layout in a layout would have no end.
    this.views = Object.fromEntries(Object.entries(place.views).filter(([name]) => name !== "layout"));
    this.choice = h("select", { "aria-label": t("Layout"), onchange: () => this.choose(this.choice.value) });
    this.adding = h(
      "select",
      { "aria-label": t("Add a view"), onchange: () => this.add() },
      h("option", { value: "" }, t("Add a view …")),
      Object.entries(this.views).map(([name, [title]]) => h("option", { value: name }, t(title))),
    );
    this.title = h("input", {
      type: "text",
      class: "layout-name",
      "aria-label": t("Name of the layout"),
      placeholder: t("Name"),
      value: this.name,
      autocomplete: "off",
      maxlength: 60,
    });
    this.file = h("input", {
      type: "file",
      accept: ".json,application/json",
      hidden: true,
      onchange: () => this.read(),
    });
    const button = (text, react, more = {}) => h("button", { type: "button", onclick: react, ...more }, text);
    this.deleting = button(t("Delete"), () => this.delete());
    this.message = h("span", { class: "muted", role: "status" });
    this.shared = h("input", {
      type: "text",
      class: "grow",
      readonly: true,
      hidden: true,
      "aria-label": t("Link of the layout"),
    });
    this.bar = h(
      "form",
      {
        class: "bar layout-bar",
        onsubmit: (event) => {
          event.preventDefault();
          this.save();
        },
      },
      this.choice,
      this.adding,
      this.title,
      h("button", { type: "submit" }, t("Save")),
      this.deleting,
      button(t("Copy link"), () => this.share()),
      button(t("Export"), () => this.export()),
      button(t("Import"), () => this.file.click()),
      this.file,
      this.message,
      this.shared,
    );
    this.start = h("div", { class: "starts" });
    this.dock = new Dock(link, new Layout(), this.views, () => this.changed());
    main.append(this.bar, this.start, this.dock.element);
    this.showNames();
    const preset = words.get("preset");
    if (preset) this.preset(preset);
    else this.show(words.get("tree") ?? "", this.name);
  }

  close() {
    this.isClosed = true;
    this.dock.close();
  }

  // --- what is shown

  show(text, name, words = null) {
    if (this.isClosed) return; // what is shown now would never be closed
    this.requested = null; // the preset that was awaited is no longer wanted
    let layout;
    try {
      layout = Layout.parse(text);
    } catch (error) {
      this.report(error.message, true);
      return;
    }
    this.name = name;
    this.title.value = name;
    this.dock.show(layout);
    this.showStart();
    this.showNames();
    this.report("");
    if (words) this.place.remember(words);
    else if (text) this.remember();
  }

  async preset(name) {
    if (!Object.hasOwn(PRESETS, name)) {
      this.report(t("There is no preset {name}.", { name }), true);
      return;
    }
    const [, , text] = PRESETS[name];
    if (text) {
      this.show(text, "", { preset: name });
      return;
    }
    const requested = (this.requested = {});
    const group = await this.group();
    if (this.requested === requested) this.show(classroom(group), "", { preset: name });
  }

  /** Return the boards of the server's machine and the topics, once they are known. */
  async group() {
    this.report(t("Looking for boards and robots …"));
    const endings = [];
    const soon = (react) =>
      new Promise((resolve) => {
        react(resolve);
        setTimeout(() => resolve(null), WAIT_MS);
      });
    const [boards] = await Promise.all([
      soon((resolve) => {
        const socket = new WebSocket(this.link.address(), this.link.protocols("minirospy.board.v1"));
        endings.push(() => socket.close());
        socket.onmessage = ({ data }) => resolve(JSON.parse(data).boards);
        socket.onerror = () => resolve(null);
      }),
      soon((resolve) => {
        if (this.link.channels.size) resolve();
        else
          endings.push(
            this.link.watch(["channels"], () => {
              if (this.link.channels.size) resolve();
            }),
          );
      }),
    ]);
    for (const end of endings) end();
    return { boards: boards ?? [], topics: [...this.link.channels.keys(), ...this.link.graph.subscribed.keys()] };
  }

  showStart() {
    const isEmpty = !this.dock.layout.root;
    this.start.hidden = !isEmpty;
    this.dock.element.hidden = isEmpty;
    if (!isEmpty) return;
    const card = (value, title, about) =>
      h(
        "button",
        { type: "button", class: "panel start", onclick: () => this.choose(value) },
        h("strong", {}, title),
        h("span", { class: "muted" }, about),
      );
    fill(
      this.start,
      Object.entries(PRESETS).map(([name, [title, about]]) => card(`preset ${name}`, t(title), t(about))),
      Object.entries(this.saved()).map(([name, text]) =>
        card(`saved ${name}`, name, t("{count} views", { count: countOf(text) })),
      ),
    );
  }

  showNames() {
    const saved = Object.keys(this.saved()).sort();
    fill(
      this.choice,
      h("option", { value: "" }, t("Layouts …")),
      h(
        "optgroup",
        { label: t("Presets") },
        Object.entries(PRESETS).map(([name, [title]]) => h("option", { value: `preset ${name}` }, t(title))),
      ),
      saved.length
        ? h(
            "optgroup",
            { label: t("Saved in this browser") },
            saved.map((name) => h("option", { value: `saved ${name}` }, name)),
          )
        : null,
    );
    this.choice.value = saved.includes(this.name) ? `saved ${this.name}` : "";
    this.deleting.hidden = !saved.includes(this.name);
  }

  report(text, isError = false) {
    setText(this.message, text);
    this.message.classList.toggle("error", isError);
    this.shared.hidden = true;
  }

  /** Keep the layout in the address. */
  remember() {
    if (!this.isClosed) this.place.remember({ name: this.name, tree: this.dock.layout.toString() });
  }

  changed() {
    if (this.isClosed) return;
    this.showStart();
    this.remember();
  }

  // --- what a person does

  choose(value) {
    const [kind, name] = value.split(/ (.*)/s);
    if (kind === "preset") this.preset(name);
    else if (kind === "saved") this.show(this.saved()[name] ?? "", name);
  }

  add() {
    const view = this.adding.value;
    this.adding.value = "";
    if (!view) return;
    // The pane is measured by its view, so the dock is seen before.
    this.start.hidden = true;
    this.dock.element.hidden = false;
    if (!this.dock.add(view)) this.report(t("A layout has {count} views at most.", { count: MAX_PANES }), true);
  }

  save() {
    const name = this.title.value.trim();
    if (!name) {
      this.report(t("Type a name first."), true);
      this.title.focus();
      return;
    }
    this.name = name;
    this.store({ ...this.saved(), [name]: this.dock.layout.toString() });
    this.showNames();
    this.remember();
    this.report(t("Saved in this browser."));
  }

  delete() {
    const { [this.name]: _, ...others } = this.saved();
    this.store(others);
    this.report(t("{name} is deleted.", { name: this.name }));
    this.name = this.title.value = "";
    this.showNames();
    this.remember();
  }

  async share() {
    this.remember();
    try {
      await navigator.clipboard.writeText(location.href);
      this.report(t("The link is copied."));
    } catch {
      // Without https a browser allows it on localhost only.
      this.report(t("Copy it from here:"));
      this.shared.hidden = false;
      this.shared.value = location.href;
      this.shared.focus();
      this.shared.select();
    }
  }

  export() {
    const name = this.title.value.trim() || "layout";
    const content = { [FILE]: 1, name, layout: this.dock.layout.toString() };
    download(
      `${name.replace(/[^\w .-]/g, "_")}.json`,
      new Blob([`${JSON.stringify(content, null, 2)}\n`], { type: "application/json" }),
    );
  }

  async read() {
    const [file] = this.file.files;
    this.file.value = "";
    if (!file) return;
    try {
      if (file.size > MAX_FILE) throw new Error(t("it is too large"));
      const content = JSON.parse(await file.text());
      if (content?.[FILE] !== 1 || typeof content.layout !== "string")
        throw new Error(t("it is not a layout of this page"));
      Layout.parse(content.layout);
      this.show(content.layout, String(content.name ?? "").slice(0, 60));
    } catch (error) {
      this.report(`${file.name}: ${error.message}`, true);
    }
  }

  // --- what is saved

  /** Return the saved layouts: name -> text. */
  saved() {
    try {
      const found = Object.entries(JSON.parse(localStorage.getItem(KEY) ?? "{}")).filter(
        ([, text]) => typeof text === "string",
      );
      return Object.fromEntries(found);
    } catch {
      return {};
    }
  }

  store(layouts) {
    try {
      localStorage.setItem(KEY, JSON.stringify(layouts));
    } catch (error) {
      this.report(error.message, true);
    }
  }
}

function countOf(text) {
  try {
    return Layout.parse(text).panes().length;
  } catch {
    return 0;
  }
}
