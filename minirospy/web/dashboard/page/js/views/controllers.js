// ros_control's controllers of one manager, as rqt_controller_manager: their states and joints; load, start, stop,
// unload.

import { STRICT, managersOf, unloadedOf } from "../control.js";
import { fill, h, redraw, setText } from "../dom.js";
import { errorText, t } from "../texts.js";

const PERIOD_MS = 2000; // between two questions for the list, the second one after the answer to the first
const COLUMNS = ["Controller", "Type", "State", "Claims", ""]; // a phone does not show the second one
const STARTABLE = [
  ["Start", ["start"]],
  ["Unload", ["unload"]],
];
const ACTIONS = new Map([
  [
    "uninitialized",
    [
      ["Load", ["load"]],
      ["Load and start", ["load", "start"]],
    ],
  ],
  ["initialized", STARTABLE],
  ["stopped", STARTABLE],
  ["aborted", STARTABLE],
  [
    "running",
    [
      ["Stop", ["stop"]],
      ["Stop and unload", ["stop", "unload"]],
    ],
  ],
  ["waiting", [["Stop", ["stop"]]]],
]);
const FAILED = {
  load: "{name} was not loaded: the log of the manager's node says why (view Console)",
  start: "{name} was not started: the log of the manager's node says why (view Console)",
  stop: "{name} was not stopped: the log of the manager's node says why (view Console)",
  unload: "{name} was not unloaded: the log of the manager's node says why (view Console)",
};

/** Fill a <select> with names and the chosen one, which may not be among them now. An open list stays open. */
export function showChoices(element, names, chosen, none) {
  const shown = chosen && !names.includes(chosen) ? [...names, chosen] : names;
  if ([...element.options].map(({ value }) => value).join() !== shown.join() || !element.options.length)
    fill(
      element,
      shown.length ? shown.map((name) => h("option", { value: name }, name)) : h("option", { value: "" }, none),
    );
  element.value = chosen;
}

/** A list of the managers to choose from, which follows the graph; `chosen` is called with the name, "" without one. */
export class ManagerChoice {
  constructor(link, manager, chosen) {
    this.link = link;
    this.manager = manager;
    this.chosen = chosen;
    this.element = h("select", {
      class: "grow",
      "aria-label": "Controller manager",
      onchange: () => this.choose(this.element.value),
    });
    this.end = link.watch(["services", "state"], () => this.update());
  }

  update() {
    const names = managersOf(this.link.services);
    // A manager that has left stays chosen: it may come back.
    if (!this.manager && names.length) {
      this.choose(names[0]);
      return;
    }
    showChoices(this.element, names, this.manager, t("no controller manager"));
  }

  get isThere() {
    return managersOf(this.link.services).includes(this.manager);
  }

  choose(manager) {
    this.manager = manager;
    this.update();
    this.chosen(manager);
  }
}

/** Ask for a manager's controllers again and again, not before the last answer has come, and not for a hidden page. */
export class ControllerLister {
  /** `received` is called with the controllers, `failed` with a text. */
  constructor(link, received, failed) {
    this.link = link;
    this.received = received;
    this.failed = failed;
    this.manager = "";
    this.asked = null; // what is waited for
    this.timer = setInterval(() => {
      if (!document.hidden) this.ask();
    }, PERIOD_MS);
  }

  close() {
    clearInterval(this.timer);
    this.manager = "";
    this.asked = null;
  }

  follow(manager) {
    this.manager = manager;
    this.asked = null;
    this.ask();
  }

  async ask() {
    const { manager } = this;
    const service = `${manager}/list_controllers`;
    if (!manager || this.asked || !this.link.mayWrite || !this.link.services.has(service)) return;
    const asked = (this.asked = {});
    try {
      const { controller } = await this.link.call(service, {});
      if (this.asked === asked) this.received(controller);
    } catch (error) {
      if (this.asked === asked) this.failed(errorText(error));
    } finally {
      if (this.asked === asked) this.asked = null;
    }
  }
}

export class Controllers {
  constructor(link, words, main, place) {
    this.link = link;
    this.controllers = null; // the loaded ones, null until they are known
    this.busy = new Set(); // the names of those that an action runs on
    this.body = h("tbody", {});
    this.table = h(
      "table",
      { class: "goals nodes controllers" },
      h(
        "thead",
        {},
        h(
          "tr",
          {},
          COLUMNS.map((each) => h("th", { scope: "col" }, each && t(each))),
        ),
      ),
      this.body,
    );
    this.problem = h("p", { class: "error", role: "alert" });
    this.empty = h("p", { class: "empty" });
    this.lister = new ControllerLister(
      link,
      (controllers) => {
        this.controllers = controllers;
        if (this.hasTrouble) this.say("");
        this.show();
      },
      (text) => this.say(text, true),
    );
    this.choice = new ManagerChoice(link, words.get("manager") ?? "", (manager) => {
      if (!this.choice) return; // chosen while it is made
      place.remember({ manager });
      this.follow(manager);
    });
    main.append(
      h(
        "div",
        { class: "bar" },
        this.choice.element,
        h(
          "button",
          {
            type: "button",
            title: "Read the list again",
            "aria-label": "Read the list again",
            onclick: () => this.lister.ask(),
          },
          "↻",
        ),
      ),
      this.problem,
      h("div", { class: "panel scroll" }, this.table, this.empty),
    );
    if (this.choice.manager) this.follow(this.choice.manager);
    this.ending = link.watch(["services", "state", "parameters"], () => {
      if (!this.controllers) this.lister.ask();
      this.show();
    });
  }

  close() {
    this.lister.close();
    this.choice.end();
    this.ending();
  }

  follow(manager) {
    this.controllers = null;
    this.say("");
    this.lister.follow(manager);
    this.show();
  }

  say(text, isTrouble = false) {
    this.hasTrouble = isTrouble;
    setText(this.problem, text);
  }

  show() {
    const { isThere, manager } = this.choice;
    const loaded = isThere ? (this.controllers ?? []) : [];
    const rows = [
      ...loaded,
      ...(isThere && this.controllers
        ? unloadedOf(
            manager,
            this.link.parameters,
            loaded.map(({ name }) => name),
          ).map((each) => ({ ...each, state: "uninitialized", claimed_resources: [] }))
        : []),
    ];
    this.table.hidden = !rows.length;
    setText(
      this.empty,
      rows.length || this.link.state !== "open"
        ? ""
        : !this.link.mayWrite
          ? t("This token is read-only: it calls no services.")
          : !manager
            ? t("No controller manager runs: a node that has one offers the service list_controllers.")
            : !isThere
              ? t("{name}: it has left", { name: manager })
              : this.controllers
                ? t("No controller is loaded, and none is on the parameter server.")
                : t("looking …"),
    );
    // The parameters and services of other nodes change often: only a new table is drawn.
    const drawn = JSON.stringify([rows, [...this.busy], this.link.mayWrite]);
    if (drawn === this.drawn) return;
    this.drawn = drawn;
    redraw(this.body, () =>
      fill(
        this.body,
        rows.map((each) => this.row(each)),
      ),
    );
  }

  row(controller) {
    const { name, type, state, claimed_resources } = controller;
    const row = h(
      "tr",
      {},
      h("td", {}, h("strong", { class: "name" }, name)),
      h("td", { class: "muted" }, type),
      h("td", {}, h("span", { class: `badge ${state}` }, t(state))),
      h(
        "td",
        {},
        claimed_resources.map(({ hardware_interface, resources }) =>
          h(
            "div",
            { class: "claim", title: hardware_interface },
            h("span", { class: "muted" }, `${hardware_interface.split("::").at(-1)}: `),
            [...resources].join(", ") || "–",
          ),
        ),
      ),
      h(
        "td",
        { class: "acts" },
        (ACTIONS.get(state) ?? []).map(([label, steps]) =>
          h(
            "button",
            {
              type: "button",
              class: "small",
              "aria-label": `${t(label)}: ${name}`,
              disabled: this.busy.has(name) || !this.link.mayWrite,
              onclick: () => this.act(name, steps),
            },
            t(label),
          ),
        ),
      ),
    );
    row.dataset.controller = name;
    return row;
  }

  async act(name, steps) {
    const { manager } = this.choice;
    const change = { start_controllers: [], stop_controllers: [], strictness: STRICT, start_asap: false, timeout: 0 };
    const calls = {
      load: ["load_controller", { name }],
      unload: ["unload_controller", { name }],
      start: ["switch_controller", { ...change, start_controllers: [name] }],
      stop: ["switch_controller", { ...change, stop_controllers: [name] }],
    };
    this.say("");
    this.busy.add(name);
    this.show();
    try {
      for (const step of steps) {
        const [call, request] = calls[step];
        const { ok } = await this.link.call(`${manager}/${call}`, request);
        if (!ok) {
          this.say(t(FAILED[step], { name }));
          break;
        }
      }
    } catch (error) {
      this.say(errorText(error));
    }
    this.busy.delete(name);
    if (manager === this.choice.manager) this.lister.follow(manager);
    this.show();
  }
}
