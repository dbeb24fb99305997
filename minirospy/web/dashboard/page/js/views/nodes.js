// Nodes: where each runs, what it publishes, subscribes to, serves and is connected to; ping, kill, and clean up after
// the dead.

import { fill, h, refill, setText } from "../dom.js";
import { Folders } from "../folders.js";
import { t } from "../texts.js";

const COLUMNS = ["Node", "Host", "Process", "CPU", "Memory", "Answers in", "Topics", "Services"];
const SORTED = { __proto__: null, Node: "", CPU: "cpu", Memory: "memory" }; // by these columns: the setting's value

export class Nodes {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.chosen = words.get("node");
    this.sort = words.get("sort") ?? "";
    this.nodes = new Map();
    this.rows = new Map();
    this.pings = new Map(); // name -> text of the last ping
    this.filter = h("input", {
      type: "search",
      placeholder: "Filter nodes and hosts",
      "aria-label": "Filter",
      oninput: () => this.showList(),
    });
    this.count = h("span", { class: "muted" });
    this.cleanButton = h("button", { type: "button", hidden: true, onclick: () => this.askCleanup() }, "Clean up …");
    this.question = h("div", {
      class: "panel details question",
      hidden: true,
      role: "alertdialog",
      "aria-label": "Confirm",
    });
    this.result = h("p", { class: "note", role: "status" });
    this.body = h("tbody", {});
    this.heads = COLUMNS.map((each) =>
      h(
        "th",
        { scope: "col" },
        each in SORTED
          ? h(
              "button",
              { type: "button", class: "link", title: "sort", onclick: () => this.sortBy(SORTED[each]) },
              t(each),
            )
          : t(each),
      ),
    );
    this.table = h("table", { class: "goals nodes" }, h("thead", {}, h("tr", {}, this.heads)), this.body);
    this.folders = new Folders(this.body, {
      rowOf: (name) => this.rows.get(name),
      show: (row, label, depth) => {
        const button = row.querySelector("button");
        setText(button, label);
        button.title = row.dataset.node;
        row.style.setProperty("--depth", String(depth));
      },
      wrap: (button) => h("tr", { class: "folder-row" }, h("th", { colspan: String(COLUMNS.length) }, button)),
      changed: () => this.showList(),
    });
    this.side = h("aside", { class: "panel details side wide", hidden: true });
    this.empty = h("p", { class: "empty" });
    main.append(
      h("div", { class: "bar" }, this.filter, this.count, this.cleanButton),
      this.result,
      this.question,
      h("div", { class: "split" }, h("div", { class: "panel scroll" }, this.table, this.empty), this.side),
    );
    this.endings = [link.tools.watch((report) => this.received(report)), link.watch(["state"], () => this.showList())];
  }

  close() {
    for (const end of this.endings) end();
  }

  received({ nodes, trouble }) {
    if (!nodes) {
      this.hasTrouble = true;
      this.note(trouble, true);
      return;
    }
    if (this.hasTrouble) this.note("");
    this.hasTrouble = false;
    this.nodes = new Map(nodes.map((node) => [node.name, node]));
    this.showList();
    this.showSide();
  }

  showList() {
    const words = this.filter.value.toLowerCase();
    for (const [name, row] of this.rows) {
      if (this.nodes.has(name)) continue;
      row.remove();
      this.rows.delete(name);
    }
    COLUMNS.forEach((each, index) => {
      if (SORTED[each] === this.sort)
        this.heads[index].setAttribute("aria-sort", this.sort ? "descending" : "ascending");
      else this.heads[index].removeAttribute("aria-sort");
    });
    const { sort } = this;
    const all = [...this.nodes];
    // Those of other machines last.
    if (sort) all.sort(([, one], [, other]) => (other[sort] ?? -1) - (one[sort] ?? -1));
    const found = [];
    for (const [name, node] of all) {
      const row = this.rows.get(name) ?? this.makeRow(name);
      this.showRow(row, node);
      if (`${name} ${node.host}`.toLowerCase().includes(words)) found.push(name);
    }
    const shown = new Set(found);
    const needed = new Set(this.chosen ? [this.chosen] : []);
    const folded = this.folders.arrange(found, { needed, isFiltered: Boolean(words), isFlat: Boolean(sort) });
    for (const [name, row] of this.rows) row.hidden = !shown.has(name) || folded.has(name);
    const dead = [...this.nodes.values()].filter(({ trouble }) => trouble).length;
    setText(
      this.count,
      this.nodes.size
        ? t(this.nodes.size === 1 ? "{count} node" : "{count} nodes", { count: this.nodes.size }) +
            (dead ? t(", {count} without an answer", { count: dead }) : "")
        : "",
    );
    this.cleanButton.hidden = !dead;
    this.cleanButton.disabled = !this.mayChange;
    this.table.hidden = !this.nodes.size;
    setText(this.empty, this.nodes.size || this.link.state !== "open" ? "" : t("looking …"));
  }

  remember() {
    this.place.remember({ node: this.chosen, sort: this.sort });
  }

  sortBy(sort) {
    this.sort = sort;
    this.remember();
    this.showList();
  }

  get mayChange() {
    return this.link.state === "open" && this.link.mayWrite;
  }

  makeRow(name) {
    const row = h(
      "tr",
      {},
      h("td", {}, h("button", { type: "button", class: "link", onclick: () => this.choose(name) }, name)),
      COLUMNS.slice(1).map(() => h("td", {})),
    );
    row.dataset.node = name;
    this.rows.set(name, row);
    return row;
  }

  showRow(row, node) {
    const [, host, pid, cpu, memory, answer, topics, services] = row.children;
    setText(host, node.host);
    setText(pid, node.pid ? String(node.pid) : "");
    setText(cpu, Number.isFinite(node.cpu) ? `${node.cpu.toFixed(1)} %` : "");
    setText(memory, node.memory ? `${(node.memory / 1e6).toFixed(1)} MB` : "");
    memory.title = node.threads
      ? t(node.threads === 1 ? "{count} thread" : "{count} threads", { count: node.threads })
      : "";
    setText(answer, node.trouble ? t("no answer") : `${node.milliseconds.toFixed(1)} ms`);
    setText(topics, t("{out} out, {in} in", { out: node.publishes.length, in: node.subscribes.length }));
    setText(services, String(node.services.length));
    row.classList.toggle("dead", Boolean(node.trouble));
    row.classList.toggle("selected", node.name === this.chosen);
  }

  choose(name) {
    this.chosen = this.chosen === name ? null : name;
    this.shown = null;
    this.remember();
    this.showList();
    this.showSide();
  }

  showSide() {
    const node = this.nodes.get(this.chosen);
    this.side.hidden = !node;
    if (!node) return;
    const content = JSON.stringify([{ ...node, milliseconds: 0, cpu: 0, memory: 0, threads: 0 }, this.mayChange]);
    if (content === this.shown) return;
    this.shown = content;
    const topics = (title, list) =>
      part(
        title,
        list.map(([topic, type]) =>
          h(
            "li",
            {},
            h("a", { href: `#/topics?open=${encodeURIComponent(topic)}` }, topic),
            " ",
            h("span", { class: "muted" }, type),
          ),
        ),
      );
    const killButton = h(
      "button",
      {
        type: "button",
        class: "danger",
        disabled: !this.mayChange || node.name === this.link.node,
        onclick: () => this.askKill(node.name),
      },
      "Kill …",
    );
    this.pingText = h("span", { class: "muted", role: "status" }, this.pings.get(node.name) ?? "");
    refill(
      this.side,
      h("h2", {}, node.name),
      node.trouble
        ? h(
            "p",
            { class: "error" },
            t("It does not answer: {trouble}.", { trouble: node.trouble }),
            " ",
            h("br"),
            sentence(node.advice),
          )
        : null,
      h(
        "table",
        { class: "values facts" },
        h(
          "tbody",
          {},
          [
            ["host", node.host],
            ["process", node.pid || ""],
            ["address", node.uri],
          ].map(([name, value]) => h("tr", {}, h("th", { scope: "row" }, t(name)), h("td", {}, value))),
        ),
      ),
      h(
        "div",
        { class: "bar" },
        h("button", { type: "button", onclick: () => this.ping(node.name) }, "Ping"),
        killButton,
        this.pingText,
        node.name === this.link.node
          ? h("span", { class: "muted" }, t("this page"))
          : this.mayChange
            ? null
            : h("span", { class: "muted" }, t("read-only")),
      ),
      topics("Publishes", node.publishes),
      topics("Subscribes to", node.subscribes),
      part(
        "Services",
        node.services.map((name) =>
          h("li", {}, h("a", { href: `#/services?service=${encodeURIComponent(name)}` }, name)),
        ),
      ),
      part(
        "Connections",
        node.links.map(([topic, direction, other, transport, isConnected, large]) =>
          h(
            "li",
            { class: isConnected ? "" : "error" },
            `${direction === "o" ? "→" : direction === "i" ? "←" : "↔"} ${other} `,
            h(
              "span",
              { class: "muted" },
              t("{topic} by {transport}", { topic, transport }) +
                (isConnected ? "" : t(", not connected")) +
                largeMessages(large),
            ),
          ),
        ),
      ),
    );
  }

  async ping(name) {
    this.showPing(name, "…");
    try {
      const { seconds } = await this.link.tools.request({ do: "ping", node: name });
      this.showPing(name, t("answered in {time} ms", { time: (seconds * 1000).toFixed(2) }));
    } catch (error) {
      this.showPing(name, error.message);
    }
  }

  showPing(name, text) {
    this.pings.set(name, text);
    if (name === this.chosen) setText(this.pingText, text);
  }

  /** Show a question; do what it asks for if a person agrees. */
  ask(text, button, act) {
    const shut = () => {
      this.question.hidden = true;
    };
    const yes = h(
      "button",
      {
        type: "button",
        class: "danger",
        onclick: () => {
          shut();
          act();
        },
      },
      button,
    );
    fill(
      this.question,
      h("p", {}, text),
      h("div", { class: "bar" }, yes, h("button", { type: "button", onclick: shut }, "Keep")),
    );
    this.question.hidden = false;
    yes.focus();
  }

  askKill(name) {
    this.ask(t("Shut down {name}? What it controls stops or goes on without it.", { name }), "Kill", async () => {
      this.note(t("{name} is requested to shut down …", { name }));
      try {
        await this.link.tools.request({ do: "kill", node: name });
        this.note(t("{name} was requested to shut down.", { name }));
      } catch (error) {
        this.note(error.message, true);
      }
    });
  }

  askCleanup() {
    const dead = [...this.nodes.values()].filter(({ trouble }) => trouble).map(({ name }) => name);
    this.ask(
      t(
        "Remove {names} from the master? A node that still runs and was only unreachable for a moment would have to be started again.",
        { names: dead.join(", ") },
      ),
      "Clean up",
      async () => {
        try {
          const removed = await this.link.tools.request({ do: "cleanup", nodes: dead });
          this.note(
            removed.length
              ? t("Removed: {names}.", { names: removed.join(", ") })
              : t("They answer again: nothing was removed."),
          );
        } catch (error) {
          this.note(error.message, true);
        }
      },
    );
  }

  note(text, isError = false) {
    setText(this.result, text);
    this.result.classList.toggle("error", isError);
  }
}

function part(title, items) {
  return items.length ? [h("h3", {}, `${t(title)} (${items.length})`), h("ul", {}, items)] : [];
}

/** How the large messages of a connection are sent: [by shared memory, all, why the others are not], or null. */
function largeMessages(large) {
  if (!large) return "";
  const [shared, all, why] = large;
  return t(", {shared} of {all} large messages by shared memory", { shared, all }) + (why ? ` (${why})` : "");
}

function sentence(text) {
  return text ? `${text[0].toUpperCase()}${text.slice(1)}.` : "";
}
