// Launch files of the packages: their arguments as a form, started, stopped, restarted; their nodes with state and log
// lines.

import { fill, h, refill, setText } from "../dom.js";
import { Endpoint } from "../endpoint.js";
import { t } from "../texts.js";

const PROTOCOL = "minirospy.launch.v1";
const MAX_LOG = 400_000; // characters
const GOOD = "d0";
const LEVELS = {
  "running": GOOD,
  "starting": "d1",
  "ending": "d1",
  "stopping": "d1",
  "stopped": "d3",
  "ended": "d3",
  "failed": "d2",
};

export class Launch {
  constructor(link, words, main, place) {
    this.place = place;
    this.files = [];
    this.launches = [];
    this.runs = new Map(); // id -> elements
    this.chosen = words.get("file") ? [words.get("package") ?? "", words.get("file")] : null;
    this.followed = null;
    this.filter = h("input", {
      type: "search",
      placeholder: "Filter packages and files",
      "aria-label": "Filter packages and files",
      oninput: () => this.drawFiles(),
    });
    this.list = h("div", { class: "launch-files" });
    this.problem = h("p", { class: "error", role: "alert" });
    this.form = h("form", {
      class: "panel details launch-form",
      hidden: true,
      onsubmit: (event) => {
        event.preventDefault();
        this.start();
      },
    });
    this.area = h("div", { class: "launches" });
    this.empty = h("p", { class: "empty" });
    this.logTitle = h("span", { class: "name" });
    this.text = h("pre", { class: "launch-log", tabindex: 0, role: "log" });
    this.log = h(
      "section",
      { class: "panel launch-output", hidden: true },
      h(
        "div",
        { class: "bar" },
        this.logTitle,
        h("span", { class: "spring" }),
        h("button", { type: "button", class: "small", onclick: () => this.text.replaceChildren() }, t("clear")),
        h(
          "button",
          { type: "button", class: "small", "aria-label": "Close the log", onclick: () => this.follow(null) },
          "×",
        ),
      ),
      this.text,
    );
    main.append(
      h(
        "div",
        { class: "split launch" },
        h(
          "div",
          { class: "panel side details launch-side" },
          h(
            "div",
            { class: "bar" },
            this.filter,
            h(
              "button",
              {
                type: "button",
                title: "Look for launch files again",
                "aria-label": "Look for launch files again",
                onclick: () => this.endpoint.send({ op: "list" }),
              },
              "↻",
            ),
          ),
          this.list,
        ),
        h("div", { class: "launch-main" }, this.problem, this.form, this.area, this.empty, this.log),
      ),
    );
    this.endpoint = new Endpoint(link, PROTOCOL, {
      opened: () => {
        this.say("");
        this.endpoint.send({ op: "list" });
        if (this.followed) this.follow(this.followed);
      },
      writes: (writes) => {
        this.writes = writes;
      },
      files: (files) => {
        this.files = files;
        this.drawFiles();
        if (this.chosen && this.form.hidden) this.describe(...this.chosen);
      },
      describe: (found) => this.showForm(found),
      launches: (launches) => this.show(launches),
      log: (which, { text, isFirst }) => this.addLog(which, text, isFirst),
      error: (text) => this.say(text),
    });
  }

  close() {
    this.endpoint.close();
  }

  say(text) {
    setText(this.problem, text);
  }

  // --- files

  drawFiles() {
    const words = this.filter.value.toLowerCase().split(/\s+/);
    const shown = this.files.filter(([name, file]) =>
      words.every((word) => `${name}/${file}`.toLowerCase().includes(word)),
    );
    const groups = Map.groupBy ? Map.groupBy(shown, ([name]) => name) : groupsOf(shown);
    refill(
      this.list,
      [...groups].map(([name, files]) =>
        h(
          "details",
          { open: groups.size <= 12 || Boolean(this.filter.value.trim()) || name === this.chosen?.[0] },
          h(
            "summary",
            {},
            h("span", { class: "name" }, name),
            " ",
            h("span", { class: "muted" }, String(files.length)),
          ),
          files.map(([, file]) => {
            const button = h(
              "button",
              { type: "button", class: "link", onclick: () => this.describe(name, file) },
              file,
            );
            if (name === this.chosen?.[0] && file === this.chosen[1]) button.setAttribute("aria-current", "true");
            return button;
          }),
        ),
      ),
    );
    if (!shown.length)
      refill(
        this.list,
        h(
          "p",
          { class: "muted" },
          this.files.length ? t("No launch file fits the filter.") : t("No package has a launch file."),
        ),
      );
    this.showEmpty();
  }

  showEmpty() {
    setText(
      this.empty,
      this.writes === false || this.launches.length || !this.form.hidden
        ? ""
        : t("Choose a launch file: its arguments appear here, and Start runs its nodes."),
    );
  }

  describe(name, file) {
    this.say("");
    this.chosen = [name, file];
    this.place.remember({ package: name, file });
    this.endpoint.send({ op: "describe", package: name, file });
    this.drawFiles();
  }

  showForm({ package: name, file, args }) {
    if (name !== this.chosen?.[0] || file !== this.chosen[1]) return;
    this.inputs = new Map(args.map(([each, value, doc]) => [each, { value, doc, input: argInput(each, value) }]));
    fill(
      this.form,
      h("h2", {}, h("span", { class: "muted" }, `${name} / `), file),
      [...this.inputs].map(([each, { value, doc, input }]) =>
        h(
          "label",
          { class: "launch-arg" },
          h("span", { class: "key" }, each),
          input,
          h(
            "span",
            { class: "muted hint" },
            doc || "",
            doc && value === null ? " " : "",
            value === null ? h("em", {}, t("required")) : "",
          ),
        ),
      ),
      args.length ? null : h("p", { class: "muted" }, "It has no arguments."),
      h(
        "div",
        { class: "bar" },
        h("button", { type: "submit", class: "primary" }, "Start"),
        h("code", { class: "muted" }, (this.commandLine = h("span", {}))),
      ),
    );
    this.form.oninput = () => this.showCommand();
    this.form.hidden = false;
    this.showCommand();
    this.showEmpty();
  }

  /** Return the arguments that differ from their defaults. */
  given() {
    return Object.fromEntries(
      [...this.inputs]
        .filter(([, { value, input }]) => input.value !== (value ?? ""))
        .map(([name, { input }]) => [name, input.value]),
    );
  }

  showCommand() {
    const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);
    // roslaunch knows a file by its name, wherever it is in its package.
    const [name, file] = this.chosen;
    const base = file.slice(file.lastIndexOf("/") + 1);
    const isOnly = this.files.filter(([each, other]) => each === name && `/${other}`.endsWith(`/${base}`)).length === 1;
    setText(
      this.commandLine,
      [
        "roslaunch",
        name,
        isOnly ? base : file,
        ...Object.entries(this.given()).map(([name, value]) => `${name}:=${quoted(value)}`),
      ].join(" "),
    );
  }

  start() {
    this.say("");
    const [name, file] = this.chosen;
    this.endpoint.send({ op: "start", package: name, file, args: this.given() });
  }

  // --- launches

  show(launches) {
    const isNew = launches.find(({ id }) => !this.runs.has(id));
    this.launches = launches;
    for (const [id, run] of this.runs) {
      if (launches.some((each) => each.id === id)) continue;
      run.element.remove();
      this.runs.delete(id);
      if (this.followed?.id === id) this.follow(null);
    }
    for (const launch of launches) {
      if (!this.runs.has(launch.id)) this.runs.set(launch.id, this.makeRun(launch));
      this.showRun(this.runs.get(launch.id), launch);
    }
    if (isNew && !this.followed) this.follow({ id: isNew.id, node: "" });
    this.showEmpty();
  }

  makeRun({ id, package: name, file, args }) {
    const button = (text, op, title) =>
      h(
        "button",
        {
          type: "button",
          class: op === "stop" ? "stop small" : "small",
          title,
          onclick: () => {
            this.say("");
            this.endpoint.send({ op, id });
          },
        },
        text,
      );
    const run = {
      badge: h("span", { class: "badge" }),
      error: h("p", { class: "error" }),
      rows: new Map(),
      table: h("tbody", {}),
      stop: button("Stop", "stop", "End its nodes"),
      restart: button("Restart", "restart", "End its nodes, and start it again"),
      remove: button("×", "remove", "Remove from this list"),
    };
    const words = Object.entries(args)
      .map(([key, value]) => `${key}:=${value}`)
      .join(" ");
    run.element = h(
      "section",
      { class: "panel launch-run" },
      h(
        "h2",
        {},
        run.badge,
        h("span", { class: "name" }, `${name} / ${file}`),
        h("code", { class: "muted" }, words),
        h("span", { class: "spring" }),
        h(
          "button",
          { type: "button", class: "small", onclick: () => this.follow({ id, node: "" }) },
          t("roslaunch log"),
        ),
        run.restart,
        run.stop,
        run.remove,
      ),
      run.error,
      h("table", { class: "values launch-nodes" }, run.table),
    );
    run.element.dataset.file = file;
    this.area.prepend(run.element);
    return run;
  }

  showRun(run, launch) {
    run.badge.className = `badge ${launch.error ? "d2" : LEVELS[launch.state]}`;
    setText(run.badge, t(launch.state));
    setText(run.error, launch.error);
    run.stop.hidden = launch.state === "ended";
    run.stop.disabled = launch.state === "stopping";
    run.remove.hidden = launch.state !== "ended";
    for (const node of launch.nodes) {
      if (!run.rows.has(node.name)) run.rows.set(node.name, this.makeNode(run, launch.id, node));
      this.showNode(run.rows.get(node.name), node, launch);
    }
  }

  makeNode(run, id, { name, program }) {
    const end = (restarts) => () => this.endpoint.send({ op: "end", id, node: name, restarts });
    const row = {
      badge: h("span", { class: "badge" }),
      pid: h("span", { class: "num" }),
      starts: h("span", { class: "muted" }),
      restart: h("button", { type: "button", class: "small", onclick: end(true) }, t("restart")),
      stop: h("button", { type: "button", class: "small", onclick: end(false) }, t("stop")),
    };
    row.log = h("button", { type: "button", class: "small", onclick: () => this.follow({ id, node: name }) }, t("log"));
    row.element = h(
      "tr",
      {},
      h("td", {}, row.badge),
      h("th", { scope: "row" }, name),
      h("td", { class: "muted" }, program),
      h("td", {}, row.starts),
      h("td", {}, row.pid),
      h("td", { class: "launch-buttons" }, row.log, row.restart, row.stop),
    );
    row.element.dataset.node = name;
    run.table.append(row.element);
    return row;
  }

  showNode(row, node, launch) {
    const isBad = node.state === "exited" && node.status !== 0;
    row.badge.className = `badge ${node.state === "exited" ? (isBad ? "d2" : "d3") : LEVELS[node.state]}`;
    setText(
      row.badge,
      node.state === "exited"
        ? isBad
          ? t("exited: {status}", { status: statusText(node.status) })
          : t("finished")
        : node.state === "failed"
          ? t("not started")
          : t(node.state),
    );
    setText(
      row.starts,
      node.starts > 1 ? t("started {count} times", { count: node.starts }) : node.respawns ? t("respawns") : "",
    );
    setText(row.pid, node.pid ? `pid ${node.pid}` : "");
    row.log.disabled = node.starts === 0;
    row.restart.disabled = row.stop.disabled = node.state !== "running" || launch.state !== "running";
    row.element.classList.toggle("selected", this.followed?.id === launch.id && this.followed.node === node.name);
  }

  // --- log lines

  follow(which) {
    this.followed = which;
    this.log.hidden = !which;
    this.text.replaceChildren();
    const launch = this.launches.find(({ id }) => id === which?.id);
    setText(this.logTitle, which ? which.node || `roslaunch ${launch?.package ?? ""} ${launch?.file ?? ""}` : "");
    this.text.setAttribute("aria-label", this.logTitle.textContent);
    this.endpoint.send({ op: "follow", id: which?.id ?? null, node: which?.node ?? "" });
    for (const each of this.launches) if (this.runs.has(each.id)) this.showRun(this.runs.get(each.id), each);
  }

  addLog({ id, node }, text, isFirst) {
    if (this.followed?.id !== id || this.followed.node !== node) return;
    if (isFirst) this.text.replaceChildren();
    const isAtEnd = this.text.scrollTop + this.text.clientHeight >= this.text.scrollHeight - 30;
    const shown = text.replace(/\x1b\[[0-9;]*[A-Za-z]/g, ""); // colors of a terminal
    for (const line of shown.split(/(?<=\n)/)) {
      const level = /\b(ERROR|FATAL|Traceback|died)\b/.test(line) ? "error" : /\bWARN/.test(line) ? "warn" : null;
      this.text.append(level ? h("span", { class: level }, line) : document.createTextNode(line));
    }
    let length = this.text.textContent.length;
    for (; length > MAX_LOG; this.text.firstChild.remove()) length -= this.text.firstChild.textContent.length;
    if (isFirst && !text) this.text.append(h("span", { class: "muted" }, t("It has printed nothing yet.")));
    if (isAtEnd || isFirst) this.text.scrollTop = this.text.scrollHeight;
  }
}

function argInput(name, value) {
  const isFlag = value === "true" || value === "false";
  if (isFlag)
    return h(
      "select",
      { name, value },
      [value, value === "true" ? "false" : "true"].map((each) => h("option", { value: each }, each)),
    );
  return h("input", {
    type: "text",
    name,
    autocomplete: "off",
    spellcheck: "false",
    value: value ?? "",
    required: value === null,
  });
}

function groupsOf(rows) {
  const groups = new Map();
  for (const row of rows) groups.set(row[0], [...(groups.get(row[0]) ?? []), row]);
  return groups;
}

function statusText(status) {
  return status < 0 ? t("signal {number}", { number: -status }) : String(status);
}
