// Class: the students at this master and in the fleet, with their boards and the exercises that each has passed. Only
// shows.

import { classTable, classTopics, readShared, storeShared, titleOf } from "../classroom.js";
import { h, refill, setText } from "../dom.js";
import { t } from "../texts.js";

const COLORS = ["green", "green", "yellow", "yellow", "red", "red"]; // of the board's LEDs
const BUTTONS = [11, 12]; // GPIO of the board's buttons
const GONE_MS = 10000; // without a beat of `minirospy check --share`, which come every three seconds

export class Class {
  constructor(link, words, main) {
    this.link = link;
    this.beats = new Map(); // topic, or key of a parameter -> {beat, at}
    this.shared = new Map(); // topic -> its last message; kept when the computer has left
    this.ends = new Map(); // topic -> what ends the subscription
    this.count = h("span", { class: "muted" });
    this.head = h("tr", {});
    this.body = h("tbody", {});
    this.table = h("table", { class: "class-table" }, h("thead", {}, this.head), this.body);
    this.empty = h("p", { class: "empty" });
    this.failed = h("ul", { class: "class-failures" });
    main.append(
      h("div", { class: "bar" }, this.count),
      h(
        "div",
        {
          class: "panel scroll",
          tabindex: "0",
          role: "region",
          "aria-label": t("Class"),
        },
        this.table,
        this.empty,
        this.failed,
      ),
    );
    this.ending = link.watch(["parameters", "channels"], () => this.update());
    this.timer = setInterval(() => this.update(), GONE_MS / 2);
  }

  close() {
    clearInterval(this.timer);
    this.ending();
    for (const end of this.ends.values()) end();
  }

  /** Subscribe to the topics of the computers that a fleet joins. */
  follow() {
    const topics = new Set(classTopics(this.link.channels.values()));
    for (const [topic, end] of this.ends) {
      if (topics.has(topic)) continue;
      end();
      this.ends.delete(topic);
    }
    for (const topic of topics) {
      if (this.ends.has(topic)) continue;
      this.ends.set(
        topic,
        this.link.subscribe({ topic, mode: "latest" }, ({ message }) => {
          const found = readShared(message?.data ?? "");
          if (!found) return;
          storeShared(this.shared, topic, found, (each) => this.ends.has(each));
          this.update();
        }),
      );
    }
  }

  update() {
    this.follow();
    const now = performance.now();
    const beats = new Map();
    const seenAt = (source, beat) => {
      const old = this.beats.get(source);
      beats.set(source, old?.beat === beat ? old : { beat, at: now });
      return beats.get(source).at;
    };
    const { exercises, students } = classTable(this.link.parameters, this.shared, seenAt);
    this.beats = beats;
    // Nothing is drawn again that has not changed, so that what a person has selected stays.
    const isLive = (student) => student.beat > 0 && now - student.at < GONE_MS;
    const live = students.filter(isLive).map(({ key }) => key);
    const shown = students.map((each) => [{ ...each, beat: 0, at: 0 }, [...each.results]]);
    const all = JSON.stringify([exercises, shown, live]);
    if (all === this.drawn) return;
    this.drawn = all;
    const passed = students.flatMap(({ results }) => [...results.values()].filter(({ ever }) => ever)).length;
    setText(
      this.count,
      t("{count} students, {passed} exercises passed", {
        count: students.length,
        passed,
      }),
    );
    this.table.hidden = !students.length;
    refill(this.empty, students.length ? [] : advice());
    refill(this.head, [
      h("th", { scope: "col" }, t("Student")),
      h("th", { scope: "col" }, t("Board")),
      ...exercises.map((name) => h("th", { scope: "col" }, name)),
    ]);
    refill(
      this.body,
      students.map((student) =>
        h(
          "tr",
          {},
          h("th", { scope: "row" }, titleOf(student)),
          h("td", { title: student.nodes.join("\n") }, live.includes(student.key) ? board(student) : ""),
          exercises.map((name) => mark(student.results.get(name))),
        ),
      ),
    );
    refill(
      this.failed,
      students.flatMap((student) =>
        [...student.results]
          .filter(([, { passed: isPassed, failures }]) => !isPassed && failures.length)
          .map(([name, { failures }]) => h("li", {}, h("b", {}, `${titleOf(student)}, ${name}: `), failures[0])),
      ),
    );
  }
}

/** Return what students type, for a class without results. */
function advice() {
  return [
    `${t("No results yet. Each student types once:")} `,
    h("code", {}, "minirospy check --join ADDRESS --name NAME"),
    `. ${t("ADDRESS is the IP address of the computer with the master. In a fleet, this suffices:")} `,
    h("code", {}, "minirospy check --share"),
  ];
}

function board(student) {
  const lit = [...student.leds].map((level, index) =>
    h("span", {
      class: level === "1" ? `class-led ${COLORS[index]}` : "class-led",
      "aria-hidden": "true",
    }),
  );
  const on = [...student.leds].flatMap((level, index) => (level === "1" ? [`GPIO ${index + 2}`] : []));
  const pressed = BUTTONS.filter((_, index) => student.buttons[index] === "1").map((pin) => `GPIO ${pin}`);
  const buttons = BUTTONS.map((_, index) =>
    h("span", {
      class: student.buttons[index] === "1" ? "class-button pressed" : "class-button",
      "aria-hidden": "true",
    }),
  );
  const hint = pressed.length ? t("pressed: {buttons}", { buttons: pressed.join(", ") }) : t("no button is pressed");
  const nodes = t("{count} nodes", { count: student.nodes.length });
  return [
    h("span", { role: "img", "aria-label": on.join(", ") || t("no LED is lit") }, lit),
    // Without the student's levels, "no button is pressed" would be a guess.
    student.buttons !== "" && h("span", { role: "img", "aria-label": hint, title: hint }, buttons),
    h("span", { class: "muted" }, nodes),
  ];
}

function mark(result) {
  if (!result) return h("td", {}, "");
  const text = result.ever ? t("passed") : t("not yet");
  return h(
    "td",
    {
      class: result.ever ? "class-yes" : "class-no",
      title: result.failures.join("\n"),
    },
    text,
  );
}
