// Actions: a form for the goal, its status, feedback and result, and every goal that the server knows.

import { brief } from "../drawing.js";
import { fill, h, setText } from "../dom.js";
import { MessageForm } from "../form.js";
import { actionServers, isRunning, progressOf, stampOf, statusWord } from "../actions.js";
import { t } from "../texts.js";
import { yaml } from "./services.js";

const MAX_IN_ROW = 300; // characters of a status
const CANCEL_TYPE = "actionlib_msgs/GoalID";
const CANCEL_TEXT = "time stamp\nstring id\n";
const MAX_GOALS = 200; // of which feedback and results are kept
const STALE_SECONDS = 5; // of the status topic, which comes at 5 Hz usually

const PAGE = crypto.getRandomValues(new Uint32Array(1))[0].toString(36); // goals of two pages are two
let sentGoals = 0;

export class Actions {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.name = words.get("action") ?? "";
    this.type = null;
    this.ends = [];
    this.goals = new Map(); // id -> {id, status, text, feedback, result, isOwn, row}
    this.chosen = null;
    this.choice = h("select", {
      class: "grow",
      "aria-label": "Action",
      onchange: () => this.choose(this.choice.value),
    });
    this.about = h("span", { class: "muted" });
    this.fields = h("div", {});
    this.sendButton = h("button", { type: "submit", class: "primary" }, "Send goal");
    this.cancelButton = h("button", { type: "button", onclick: () => this.cancelAll() }, "Cancel all goals");
    this.buttons = h("div", { class: "bar", hidden: true }, this.sendButton, this.cancelButton);
    this.problem = h("p", { class: "error", role: "alert" });
    this.rows = h("tbody", {});
    this.table = h(
      "table",
      { class: "goals" },
      h(
        "thead",
        {},
        h(
          "tr",
          {},
          ["Goal", "Status", "", ""].map((each) => h("th", { scope: "col" }, each && t(each))),
        ),
      ),
      this.rows,
    );
    this.noGoals = h("p", { class: "muted" });
    this.badge = h("span", { class: "badge" });
    this.title = h("h2", { class: "grow" });
    this.statusText = h("p", { class: "note" }); // the status text of the server
    this.silent = h("p", { class: "error", role: "status" });
    this.bar = h("progress", { max: "1", hidden: true, "aria-label": "Progress" });
    this.feedback = h("pre", { class: "answer", "aria-label": "Feedback" });
    this.result = h("pre", { class: "answer", "aria-label": "Result", "aria-live": "polite" });
    this.details = h(
      "section",
      { class: "panel details", hidden: true, "aria-label": "Chosen goal" },
      h("div", { class: "bar" }, this.title, this.badge),
      this.statusText,
      this.bar,
      h(
        "div",
        { class: "halves" },
        h("div", {}, h("h3", {}, "Feedback"), this.feedback),
        h("div", {}, h("h3", {}, "Result"), this.result),
      ),
    );
    main.append(
      h("div", { class: "bar" }, this.choice, this.about),
      this.problem,
      this.silent,
      h(
        "div",
        { class: "halves actions" },
        h(
          "form",
          {
            class: "panel details",
            onsubmit: (event) => {
              event.preventDefault();
              this.send();
            },
          },
          this.fields,
          this.buttons,
        ),
        h(
          "div",
          { class: "column" },
          this.details,
          h(
            "section",
            { class: "panel details", "aria-label": "Goals" },
            h("h3", {}, "Goals of the server"),
            this.table,
            this.noGoals,
          ),
        ),
      ),
    );
    this.ending = link.watch(["channels", "state"], () => this.update());
    this.timer = setInterval(() => this.showGoals(), 1000);
  }

  close() {
    clearInterval(this.timer);
    this.ending();
    this.leave();
  }

  leave() {
    for (const end of this.ends) end();
    this.ends = [];
    if (this.hasSent) for (const topic of ["goal", "cancel"]) this.link.unpublish(`${this.name}/${topic}`);
    this.hasSent = false;
    this.goals.clear();
    this.rows.replaceChildren();
    this.chosen = null;
    this.type = null;
    this.seen = null;
    this.details.hidden = true;
  }

  update() {
    const servers = actionServers(this.link.channels);
    const names = servers.map(({ name }) => name);
    if (names.join(" ") !== this.names || !this.choice.options.length) {
      this.names = names.join(" ");
      fill(
        this.choice,
        h(
          "option",
          { value: "" },
          names.length ? t("choose an action server ({count})", { count: names.length }) : t("no action servers"),
        ),
        names.map((name) => h("option", { value: name }, name)),
      );
    }
    const server = servers.find(({ name }) => name === this.name);
    this.choice.value = server ? this.name : "";
    if (server && server.type !== this.type) this.open(server);
    const mayWrite = this.link.state === "open" && this.link.mayWrite;
    this.sendButton.disabled = this.cancelButton.disabled = !mayWrite || !server;
    if (!server && !this.type) {
      fill(
        this.fields,
        h(
          "p",
          { class: "muted" },
          this.link.state !== "open"
            ? ""
            : names.length
              ? t("Choose an action server: its goal becomes a form.")
              : t("No node offers an action. Start one: it appears here."),
        ),
      );
      setText(this.noGoals, "");
    }
    if (this.type)
      setText(
        this.about,
        `${this.type}Action${server || this.link.state !== "open" ? "" : t(": the server has left")}`,
      );
  }

  choose(name) {
    this.leave();
    this.name = name;
    this.buttons.hidden = true;
    setText(this.problem, "");
    setText(this.about, "");
    this.place.remember({ action: name });
    this.update();
  }

  async open({ name, type }) {
    this.leave();
    this.type = type;
    this.ends = [
      this.link.subscribe({ topic: `${name}/status`, mode: "latest" }, (item) => this.received(item)),
      this.link.subscribe({ topic: `${name}/feedback`, mode: "all" }, ({ lines = [] }) => {
        for (const { message } of lines) this.take(message, { feedback: message.feedback });
      }),
      this.link.subscribe({ topic: `${name}/result`, mode: "all" }, ({ lines = [] }) => {
        for (const { message } of lines) this.take(message, { result: message.result });
      }),
    ];
    this.buttons.hidden = true;
    fill(
      this.fields,
      h("p", { class: "muted" }, this.link.mayWrite ? "" : t("This token is read-only: it sends no goals.")),
    );
    if (!this.link.mayWrite) return;
    try {
      const { definition } = await this.link.tools.request({ do: "type", name: `${type}ActionGoal` });
      if (this.type !== type) return;
      this.schema = definition;
      const described = this.link.definition(`${type}ActionGoal`, definition);
      this.form = new MessageForm(described.fields.find((each) => each.name === "goal").message);
      fill(this.fields, this.form.element);
      this.buttons.hidden = false;
    } catch (error) {
      fill(this.fields, h("p", { class: "error" }, error.message));
    }
  }

  // --- goals

  now() {
    return this.link.time ?? Date.now() / 1000;
  }

  async send() {
    setText(this.problem, "");
    const stamp = stampOf(this.now());
    const id = `dashboard-${PAGE}-${++sentGoals}-${stamp.secs}.${String(stamp.nsecs).padStart(9, "0")}`;
    try {
      const goal = this.form.value();
      this.hasSent = true;
      const own = this.goalOf(id);
      own.isOwn = true;
      this.select(id);
      await this.link.publish(`${this.name}/goal`, `${this.type}ActionGoal`, this.schema, {
        header: { stamp },
        goal_id: { stamp, id },
        goal,
      });
      this.showGoals();
    } catch (error) {
      this.goals.get(id)?.row.remove();
      this.goals.delete(id);
      if (this.chosen === id) this.select(null);
      setText(this.problem, error.message);
    }
  }

  async cancel(id) {
    try {
      this.hasSent = true;
      await this.link.publish(`${this.name}/cancel`, CANCEL_TYPE, CANCEL_TEXT, { stamp: { secs: 0, nsecs: 0 }, id });
    } catch (error) {
      setText(this.problem, error.message);
    }
  }

  cancelAll() {
    // No id and no time: all goals.
    this.cancel("");
  }

  goalOf(id) {
    let goal = this.goals.get(id);
    if (!goal) {
      if (this.goals.size >= MAX_GOALS) this.forgetOne();
      goal = { id, status: null, text: "", isOwn: false, isListed: false, received: null };
      const cancel = h(
        "button",
        { type: "button", class: "small", title: t("Cancel {id}", { id }), onclick: () => this.cancel(id) },
        t("cancel"),
      );
      goal.cancel = cancel;
      goal.row = h(
        "tr",
        {},
        h(
          "td",
          {},
          h(
            "button",
            { type: "button", class: "link", onclick: () => this.select(this.chosen === id ? null : id) },
            id,
          ),
        ),
        h("td", {}, h("span", { class: "badge" })),
        h("td", { class: "muted" }),
        h("td", {}, cancel),
      );
      goal.row.dataset.goal = id;
      this.goals.set(id, goal);
      this.rows.prepend(goal.row);
    }
    return goal;
  }

  forgetOne() {
    for (const goal of this.goals.values()) {
      if (goal.isListed || goal.id === this.chosen) continue;
      goal.row.remove();
      this.goals.delete(goal.id);
      return;
    }
  }

  received({ message, error }) {
    if (error) {
      setText(this.problem, error);
      return;
    }
    this.seen = performance.now() / 1000;
    for (const goal of this.goals.values()) goal.isListed = false;
    for (const {
      goal_id: { id },
      status,
      text,
    } of message.status_list.slice(-MAX_GOALS)) {
      Object.assign(this.goalOf(id), { status, text, isListed: true });
    }
    this.showGoals();
  }

  take(
    {
      status: {
        goal_id: { id },
        status,
        text,
      },
    },
    more,
  ) {
    const goal = this.goalOf(id);
    // A result's status is final; the status topic may be older.
    if (more.result || goal.result === undefined) Object.assign(goal, { status, text });
    Object.assign(goal, more);
    if (more.result) goal.finalStatus = status;
    this.showGoals();
  }

  select(id) {
    this.chosen = id;
    this.showGoals();
  }

  showGoals() {
    const isStale =
      this.seen !== null && this.seen !== undefined && performance.now() / 1000 - this.seen > STALE_SECONDS;
    for (const goal of this.goals.values()) {
      const status = goal.finalStatus ?? goal.status;
      const [, badgeCell, textCell] = goal.row.children;
      showBadge(badgeCell.firstChild, status);
      setText(textCell, brief(goal.text, MAX_IN_ROW) || (goal.isOwn ? t("sent here") : ""));
      goal.cancel.hidden = status === null ? !goal.isOwn : !isRunning(status);
      goal.cancel.disabled = !this.link.mayWrite;
      goal.row.classList.toggle("selected", goal.id === this.chosen);
    }
    this.table.hidden = !this.goals.size;
    setText(this.silent, this.type && isStale ? t("The server has sent no status for 5 seconds.") : "");
    setText(this.noGoals, !this.type ? "" : this.goals.size ? "" : t("None yet."));
    const goal = this.goals.get(this.chosen);
    this.details.hidden = !goal;
    if (!goal) return;
    setText(this.title, goal.id);
    setText(this.statusText, goal.text);
    showBadge(this.badge, goal.finalStatus ?? goal.status);
    const progress = goal.finalStatus === 3 ? 1 : progressOf(goal.feedback);
    this.bar.hidden = progress === null;
    if (progress !== null) this.bar.value = progress;
    setText(this.feedback, goal.feedback ? yaml(goal.feedback) || t("(no fields)") : t("none yet"));
    setText(this.result, goal.result ? yaml(goal.result) || t("(no fields)") : t("none yet"));
  }
}

function showBadge(badge, status) {
  setText(badge, status === null ? t("Sent") : t(statusWord(status)));
  badge.className = `badge ${status === 3 ? "d0" : status === 1 || status === 0 ? "running" : status === null ? "d3" : status === 4 || status === 5 || status === 9 ? "d2" : "d1"}`;
}
