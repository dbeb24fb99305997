// The first view: what is running, and is it well? Nodes, topics, the doctor's advice, boards and log lines.

import { fragmentOf } from "../address.js";
import { BoardStrip } from "../board_strip.js";
import { bandwidth, fill, h, refill, setText, withCode } from "../dom.js";
import { translated } from "../findings.js";
import { TopicHealth, linesToShow, nodesOf, signatureOf, verdictOf, viewOf } from "../health.js";
import { NAMES, linesOf, timeText } from "../logs.js";
import { t } from "../texts.js";
import { collect } from "./console.js";

const MAX_ROWS = 40; // of nodes and of topics; the rest is a link away
const MAX_LINES = 30;
const MAX_WARNINGS = 10; // that stay if many lines came since
const MAX_BOARDS = 4;
const EXAMINE_MS = 60_000; // between examinations of a graph that does not change
const SETTLE_MS = 4000; // a graph that changes is examined once it stays as it is
const STATES = {
  mismatch: "different types",
  unpublished: "not published",
  silent: "silent",
};

export class Overview {
  constructor(link, words, main) {
    this.link = link;
    this.health = new TopicHealth();
    this.nodes = null;
    this.topics = [];
    this.findings = null;
    this.trouble = "";
    this.history = []; // lines from before the page was opened
    this.strips = new Map();
    this.verdict = h("p", { class: "verdict", role: "status" });
    this.about = h("span", { class: "muted" });
    this.again = h("button", { type: "button", onclick: () => this.examine() }, "Check again");
    this.advice = h("ul", { class: "findings" });
    this.nodeTitle = h("span", {});
    this.nodeList = h("tbody", {});
    this.topicTitle = h("span", {});
    this.topicList = h("tbody", {});
    this.moreNodes = h("p", { class: "more" });
    this.moreTopics = h("p", { class: "more" });
    this.boards = h("div", {});
    this.boardPanel = panel("Board", "#/board", this.boards);
    this.boardPanel.hidden = true;
    this.lines = h("ol", { class: "recent" });
    main.append(
      h("div", { class: "bar overview-head" }, this.verdict, this.about, this.again),
      h(
        "div",
        { class: "overview" },
        panel("What to do", null, this.advice),
        panel(this.nodeTitle, "#/nodes", table("Nodes", this.nodeList), this.moreNodes),
        panel(this.topicTitle, "#/topics", table("Topics", this.topicList), this.moreTopics),
        h("div", { class: "overview-side" }, this.boardPanel, panel("Log", "#/console", this.lines)),
      ),
    );
    this.isVisible = !document.hidden;
    this.onVisible = () => this.changeVisible();
    document.addEventListener("visibilitychange", this.onVisible);
    this.endings = [link.watch(["state"], () => this.changeState()), collect(link, (lines) => this.showLines(lines))];
    this.watch();
  }

  close() {
    document.removeEventListener("visibilitychange", this.onVisible);
    clearTimeout(this.timer);
    this.unwatch?.();
    for (const end of this.endings) end();
    for (const strip of this.strips.values()) strip.close();
  }

  /** Nodes are asked only while a person can see what they answer. */
  changeVisible() {
    if (document.hidden) {
      this.unwatch?.();
      this.unwatch = null;
      clearTimeout(this.timer);
    } else this.watch();
  }

  watch() {
    this.unwatch ??= this.link.tools.watch((report) => this.received(report));
    this.examineIn(0);
  }

  async changeState() {
    const { state } = this.link;
    if (state === "open") {
      this.refusal = null;
      this.examineIn(0);
      this.readHistory();
      this.showBoards();
    } else if (state !== "connecting") {
      const refusal = await this.link.refusal();
      if (this.link.state === state) this.refusal = refusal;
    }
    this.show();
  }

  received({ nodes, traffic, mismatches, trouble }) {
    this.trouble = trouble ?? "";
    if (nodes) {
      this.nodes = nodesOf({ nodes });
      this.topics = this.health.received({ nodes, traffic, mismatches });
      const signature = signatureOf(this.nodes, this.topics);
      if (this.signature !== undefined && signature !== this.signature) this.examineIn(SETTLE_MS);
      this.signature = signature;
      this.showBoards();
    }
    this.show();
  }

  examineIn(milliseconds) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.examine(), milliseconds);
  }

  /** Let the doctor look at the graph, now and again later. */
  async examine() {
    clearTimeout(this.timer);
    if (this.link.state !== "open") return;
    const asked = (this.asked = {});
    this.again.disabled = true;
    try {
      const { findings } = await this.link.tools.request({ do: "examine" });
      if (this.asked === asked) this.findings = findings;
    } catch (error) {
      if (this.asked === asked && this.link.state === "open") this.findings = [failure(error)];
    }
    if (this.asked !== asked) return;
    this.again.disabled = false;
    this.show();
    if (!document.hidden && this.unwatch) this.examineIn(EXAMINE_MS);
  }

  async readHistory() {
    const { text } = await this.link.tools.request({ do: "log" }).catch(() => ({ text: "" }));
    this.history = linesOf(text, "").filter(({ stamp }) => stamp); // the file's first line is no log line
    this.showLines(this.live ?? []);
  }

  async showBoards() {
    const { names } = await this.link.tools.request({ do: "boards" }).catch(() => ({ names: null }));
    if (!names) return;
    const wanted = names.slice(0, MAX_BOARDS);
    for (const [name, strip] of this.strips) {
      if (wanted.includes(name)) continue;
      strip.close();
      strip.element.remove();
      this.strips.delete(name);
    }
    for (const name of wanted) {
      if (this.strips.has(name)) continue;
      const strip = new BoardStrip(this.link, name);
      this.strips.set(name, strip);
      this.boards.append(strip.element);
    }
    this.boardPanel.hidden = !this.strips.size;
  }

  show() {
    this.showVerdict();
    this.showAdvice();
    this.showNodes();
    this.showTopics();
  }

  showVerdict() {
    const { state } = this.link;
    let level = "unknown";
    let text = t("looking …");
    if (this.refusal || state === "lost" || state === "refused") {
      level = "problem";
      text = this.refusal?.status === 503 ? t("There is no ROS master yet.") : t("The dashboard does not answer.");
    } else if (this.trouble) {
      level = "problem";
      text = t("The ROS master does not answer.");
    } else if (this.findings && this.nodes) {
      const verdict = verdictOf(this.findings, this.topics);
      level = verdict.level;
      const counts = [
        [verdict.problems, "{count} problem", "{count} problems"],
        [verdict.warnings, "{count} warning", "{count} warnings"],
      ];
      text = counts
        .filter(([count]) => count)
        .map(([count, one, many]) => t(count === 1 ? one : many, { count }))
        .join(", ");
      text ||= t("All is well.");
    } else if (this.nodes) text = t("checking …");
    this.verdict.dataset.level = level;
    setText(this.verdict, text);
    const about = state === "open" && this.findings ? t("as `minirospy doctor` finds") : "";
    if (about !== this.shownAbout) fill(this.about, withCode(about));
    this.shownAbout = about;
  }

  showAdvice() {
    const found = this.adviceNow();
    const content = JSON.stringify([found, Boolean(this.findings)]);
    if (content === this.shownAdvice) return;
    this.shownAdvice = content;
    refill(
      this.advice,
      found.map(({ status, check, text, advice, view }) =>
        h(
          "li",
          { class: status },
          h("strong", {}, check, ": "),
          h("span", {}, withCode(translated(text))),
          advice ? h("p", { class: "advice" }, h("span", {}, "→ ", withCode(translated(advice)))) : null,
          view ? h("p", { class: "advice" }, h("a", { href: fragmentOf(...view) }, t("Show more"))) : null,
        ),
      ),
    );
    if (!found.length)
      this.advice.append(h("li", { class: "ok" }, this.findings ? t("Nothing to do.") : t("checking …")));
  }

  /** Return what is wrong, and what to do about it. */
  adviceNow() {
    if (this.refusal) return [{ status: "problem", check: "master", text: this.refusal.text, advice: "", view: null }];
    if (this.trouble) return [{ status: "problem", check: "master", text: this.trouble, advice: "", view: null }];
    const findings = (this.findings ?? [])
      .filter(({ status }) => status !== "ok")
      .map((each) => ({ ...each, view: viewOf(each) }));
    const silent = this.topics
      .filter(({ state }) => state === "silent")
      .slice(0, MAX_ROWS)
      .map(({ topic, publishers }) => ({
        status: "warning",
        check: "topics",
        text: t("{topic} is silent: {nodes} sends nothing", {
          topic,
          nodes: publishers.join(", "),
        }),
        advice: t("look at that node's log lines, and at the device that it reads"),
        view: ["console", { node: publishers[0] }],
      }));
    return [...findings, ...silent].sort((one, other) => rankOf(one) - rankOf(other));
  }

  showNodes() {
    const nodes = this.nodes ?? [];
    const dead = nodes.filter(({ trouble }) => trouble).length;
    if (!this.nodes) setText(this.nodeTitle, t("Nodes"));
    else
      setText(
        this.nodeTitle,
        t(nodes.length === 1 ? "{count} node" : "{count} nodes", { count: nodes.length }) +
          (dead ? t(", {count} without an answer", { count: dead }) : ""),
      );
    refill(
      this.nodeList,
      nodes.slice(0, MAX_ROWS).map(({ name, trouble, cpu, host }) => {
        const row = h(
          "tr",
          { class: trouble ? "bad" : "" },
          h("td", {}, mark(trouble ? "bad" : "good", trouble ? "no answer" : "it answers")),
          h("th", { scope: "row" }, h("a", { href: fragmentOf("nodes", { node: name }) }, name)),
          h("td", { class: "num" }, trouble ? t("no answer") : Number.isFinite(cpu) ? `${cpu.toFixed(1)} % CPU` : host),
        );
        row.dataset.node = name;
        return row;
      }),
    );
    showMore(this.moreNodes, nodes.length - MAX_ROWS, "#/nodes");
  }

  showTopics() {
    const { topics } = this;
    const title = topics.length === 1 ? "{count} topic" : "{count} topics";
    setText(this.topicTitle, this.nodes ? t(title, { count: topics.length }) : t("Topics"));
    refill(
      this.topicList,
      topics.slice(0, MAX_ROWS).map(({ topic, type, hz, bytes, state, publishers }) => {
        const isBad = Object.hasOwn(STATES, state);
        const title = isBad ? STATES[state] : state === "flows" ? "messages come" : "no message at present";
        const rate =
          hz === null
            ? publishers.length
              ? t("nobody listens")
              : ""
            : `${hz < 10 ? hz.toFixed(1) : hz.toFixed(0)} Hz`;
        const row = h(
          "tr",
          { class: isBad ? "bad" : "" },
          h("td", {}, mark(isBad ? "bad" : state === "flows" ? "good" : "none", title)),
          h("th", { scope: "row", title: type || null }, h("a", { href: linkOf(topic, state, publishers) }, topic)),
          h("td", { class: "num", title: hz ? bandwidth(bytes) : null }, isBad ? t(STATES[state]) : rate),
        );
        row.dataset.topic = topic;
        row.dataset.state = state;
        return row;
      }),
    );
    if (!topics.length && this.nodes)
      this.topicList.append(
        h(
          "tr",
          {},
          h(
            "td",
            { colspan: "3", class: "muted" },
            t("Nothing is published yet. Start a node: its topics appear here."),
          ),
        ),
      );
    showMore(this.moreTopics, topics.length - MAX_ROWS, "#/topics");
  }

  showLines(lines) {
    this.live = lines;
    // The file has the lines that came since, too.
    const first = lines[0]?.stamp ?? Infinity;
    const all = [...this.history.filter(({ stamp }) => stamp < first - 0.001), ...lines];
    fill(
      this.lines,
      linesToShow(all, MAX_LINES, MAX_WARNINGS)
        .reverse()
        .map((line) => {
          const item = h(
            "li",
            {},
            h("span", { class: "time" }, timeText(line.stamp)),
            " ",
            h("strong", { class: "word" }, t(NAMES.get(line.level) ?? String(line.level))),
            " ",
            h("a", { href: fragmentOf("console", { node: line.node }) }, line.node),
            " ",
            h("span", { class: "text" }, line.text.slice(0, 300)),
          );
          item.dataset.level = line.level;
          return item;
        }),
    );
    if (!all.length) this.lines.append(h("li", { class: "muted" }, t("No line yet.")));
  }
}

const rankOf = ({ status }) => (status === "problem" ? 0 : 1);
const failure = (error) => ({ check: "doctor", status: "warning", text: error.message, advice: "" });

/** Return the link of a topic: its values, or for one without a publisher the graph. */
function linkOf(topic, state, publishers) {
  return publishers.length && state !== "mismatch"
    ? fragmentOf("topics", { open: topic })
    : fragmentOf("graph", { filter: topic });
}

function panel(title, href, ...content) {
  return h(
    "section",
    { class: "panel overview-panel" },
    h("h2", {}, href ? h("a", { href }, title) : title),
    h(
      "div",
      { class: "overview-body", tabindex: "0", role: "group", "aria-label": typeof title === "string" ? title : null },
      ...content,
    ),
  );
}

function table(name, body) {
  const heads = ["State", "Name", "Rate or load"].map((each) =>
    h("th", { scope: "col" }, h("span", { class: "spoken" }, t(each))),
  );
  return h("table", { class: "well", "aria-label": name }, h("thead", {}, h("tr", {}, heads)), body);
}

function mark(kind, title) {
  return h("span", { class: `mark ${kind}`, role: "img", title, "aria-label": title });
}

function showMore(element, count, href) {
  element.hidden = count <= 0;
  if (count > 0) refill(element, h("a", { href }, t("{count} more", { count })));
}
