// State machines of smach, as smach_viewer shows them: containers in containers, active states, userdata; and where
// they start the next time.

import { Graph, layout } from "../../vendor/dagre/dagre.esm.js";
import { brief, loopOf, pathOf } from "../drawing.js";
import { fill, h, redraw, refill, setText, svg, uniqueId } from "../dom.js";
import { PanZoom } from "../panzoom.js";
import { userdataOf } from "../pickle.js";
import { activeOf, activeStates, layoutContainer, roots } from "../smach_layout.js";
import { language, t } from "../texts.js";

const STRUCTURE = "smach_msgs/SmachContainerStructure";
const INIT = "smach_msgs/SmachContainerInitialStatusCmd";
const INIT_TEXT = `# The path to the node in the server
string path

# If there's only one child, this will contain only one item
string[] initial_states

# Initial values for the local user data at the start of this container
# (pickled, and as base64)
string local_data
`;
const EMPTY_USERDATA = "gAJ9cQAu"; // pickle.dumps({}, 2) as base64
const MAX_CONTAINERS = 500;
const MAX_EVENTS = 100;
const MAX_SENDS = 10;
const SEND_MS = 400;
const GAP = 40; // between outermost containers

export class Smach {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.server = words.get("server") ?? "";
    this.structures = new Map(); // topic's server and path -> structure
    this.statuses = new Map();
    this.events = [];
    this.folded = new Set();
    this.selected = null; // {path, state or null}
    this.ends = new Map(); // topic -> end of its subscription
    this.arrow = uniqueId("smach");
    this.choice = h("select", { "aria-label": "State machine", onchange: () => this.choose(this.choice.value) });
    this.now = h("span", { class: "smach-now", role: "status" });
    this.drawing = svg("g", {});
    this.picture = svg(
      "svg",
      { class: "graph smach", role: "group", "aria-label": "States and transitions" },
      svg(
        "defs",
        {},
        svg(
          "marker",
          {
            id: this.arrow,
            viewBox: "0 0 10 10",
            refX: 9,
            refY: 5,
            markerWidth: 7,
            markerHeight: 7,
            orient: "auto-start-reverse",
          },
          svg("path", { d: "M0 0 10 5 0 10z", class: "head" }),
        ),
      ),
      this.drawing,
    );
    this.empty = h("p", { class: "empty" });
    this.details = h("aside", { class: "panel details side" });
    this.problem = h("p", { class: "error", role: "alert" });
    main.append(
      h(
        "div",
        { class: "bar" },
        this.choice,
        this.now,
        h("span", { class: "spring" }),
        h("button", { type: "button", onclick: () => this.panzoom.fit() }, "Fit"),
      ),
      this.problem,
      h("div", { class: "split" }, h("div", { class: "panel canvas" }, this.picture, this.empty), this.details),
    );
    this.panzoom = new PanZoom(this.picture, this.drawing);
    this.ending = link.watch(["channels", "state"], () => this.update());
  }

  close() {
    this.isClosed = true;
    this.ending();
    this.panzoom.close();
    for (const end of this.ends.values()) end();
  }

  // --- what there is

  update() {
    const servers = [...this.link.channels.values()]
      .filter(({ type }) => type === STRUCTURE)
      .map(({ topic }) => topic.slice(0, topic.lastIndexOf("/smach/")));
    const text = servers.join(" ");
    if (text !== this.servers) {
      this.servers = text;
      fill(
        this.choice,
        servers.length ? null : h("option", { value: "" }, t("no state machine")),
        servers.map((name) => h("option", { value: name }, name || "/")),
      );
    }
    if (!servers.includes(this.server) && servers.length && this.link.state === "open") this.choose(servers[0], false);
    this.choice.value = this.server;
    if (servers.includes(this.server)) this.subscribe();
    setText(
      this.empty,
      this.structures.size || this.link.state !== "open"
        ? ""
        : servers.length
          ? t("Waiting for the structure …")
          : t("No state machine publishes what it does: start {server} in its program.", {
              server: 'smach_ros.IntrospectionServer("name", machine, "/ROOT")',
            }),
    );
  }

  choose(server, isRemembered = true) {
    for (const end of this.ends.values()) end();
    this.ends.clear();
    this.structures.clear();
    this.statuses.clear();
    this.events = [];
    this.selected = null;
    this.server = server;
    this.signature = null;
    this.panzoom.isFitted = true;
    this.drawing.replaceChildren();
    if (isRemembered) this.place.remember(server ? { server } : {});
    this.update();
    this.showDetails();
  }

  subscribe() {
    /** @type {[string, (line: any) => void][]} */
    const topics = [
      ["container_structure", (line) => this.structure(line)],
      ["container_status", (line) => this.status(line)],
    ];
    for (const [name, received] of topics) {
      const topic = `${this.server}/smach/${name}`;
      if (this.ends.has(topic)) continue;
      this.ends.set(
        topic,
        this.link.subscribe({ topic, mode: "all" }, ({ lines = [], error }) => {
          setText(this.problem, error ?? "");
          for (const line of lines) received(line);
          this.draw();
        }),
      );
    }
  }

  structure({ message }) {
    if (this.structures.size < MAX_CONTAINERS || this.structures.has(message.path))
      this.structures.set(message.path, message);
  }

  status({ message, seconds }) {
    if (this.statuses.size >= MAX_CONTAINERS && !this.statuses.has(message.path)) return;
    const before = this.statuses.get(message.path);
    this.statuses.set(message.path, message);
    const active = activeOf(message);
    if (!before || activeOf(before).join() !== active.join()) {
      this.events.unshift({ seconds, path: message.path, active });
      this.events.length = Math.min(this.events.length, MAX_EVENTS);
    }
  }

  // --- drawing

  draw() {
    setText(this.empty, this.structures.size ? "" : t("Waiting for the structure …"));
    const signature = JSON.stringify([
      [...this.structures.values()].map(({ header: _header, ...rest }) => rest),
      [...this.folded],
    ]);
    if (signature !== this.signature) {
      redraw(this.drawing, () => {
        this.signature = signature;
        this.drawStructure();
      });
    }
    this.highlight();
    this.showDetails();
  }

  drawStructure() {
    const measure = h("canvas").getContext("2d");
    measure.font = "600 14px system-ui, sans-serif";
    const tools = {
      Graph,
      layout,
      widthOf: (text) => measure.measureText(brief(text)).width,
      isFolded: (path) => this.folded.has(path),
    };
    this.parts = new Map(); // path of a state or container -> element
    this.drawing.replaceChildren();
    let x = 10;
    let height = 0;
    for (const path of roots(this.structures)) {
      const found = layoutContainer(path, this.structures, tools);
      this.drawing.append(this.container(found, x, 10));
      x += found.width + GAP;
      height = Math.max(height, found.height);
    }
    this.panzoom.resized(x - GAP + 10, height + 20);
  }

  container(found, x, y) {
    const { path, width, height } = found;
    const name = path.slice(path.lastIndexOf("/") + 1) || path;
    const group = svg(
      "g",
      { class: "smach-container", transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})` },
      svg("rect", { width, height, rx: 10 }),
      svg("title", {}, path),
      svg("text", { class: "smach-title", x: 14, y: 21 }, brief(name)),
      found.edges.map((edge) =>
        svg(
          "g",
          { class: "edge" },
          svg("path", {
            d: edge.loop ? loopOf(edge.loop, edge) : pathOf(edge.points),
            "marker-end": `url(#${this.arrow})`,
          }),
          svg("title", {}, edge.label),
          svg("text", { x: edge.x, y: edge.y + 4 }, brief(edge.label)),
        ),
      ),
      found.outcomes.map((each) =>
        svg(
          "g",
          { class: "smach-outcome" },
          svg("rect", {
            x: each.x - each.width / 2,
            y: each.y - each.height / 2,
            width: each.width,
            height: each.height,
            rx: 3,
          }),
          svg("title", {}, each.name),
          svg("text", { x: each.x, y: each.y + 4 }, brief(each.name)),
        ),
      ),
    );
    this.parts.set(path, group);
    this.makeButton(group.firstChild, path, null);
    for (const state of found.states) {
      const key = `${path}/${state.name}`;
      let part;
      if (state.inner) {
        part = this.container(state.inner, state.x - state.width / 2, state.y - state.height / 2);
      } else {
        part = svg(
          "g",
          {
            class: `smach-state${state.isContainer ? " folded" : ""}`,
            transform: `translate(${(state.x - state.width / 2).toFixed(1)} ${(state.y - state.height / 2).toFixed(1)})`,
          },
          svg("rect", { width: state.width, height: state.height, rx: state.height / 2 }),
          svg("title", {}, key),
          svg(
            "text",
            { x: state.width / 2, y: state.height / 2 + 5 },
            state.isContainer ? `${brief(state.name)} ▸` : brief(state.name),
          ),
        );
        this.makeButton(part, path, state.name);
      }
      part.dataset.state = key;
      this.parts.set(key, part);
      group.append(part);
    }
    return group;
  }

  makeButton(element, path, state) {
    const select = (event) => {
      event.stopPropagation();
      this.selected = { path, state };
      this.highlight();
      this.shown = null;
      this.showDetails();
    };
    element.addEventListener("click", select);
    element.addEventListener("keydown", (event) => {
      if (event.key === "Enter" || event.key === " ") {
        event.preventDefault(); // the page would scroll
        select(event);
      }
    });
    element.setAttribute("tabindex", 0);
    element.setAttribute("role", "button");
    element.setAttribute(
      "aria-label",
      state === null ? t("container {path}", { path }) : t("state {state} of {path}", { state, path }),
    );
  }

  highlight() {
    const active = activeStates(this.structures, this.statuses);
    const initial = new Set(
      [...this.statuses.values()].flatMap(({ path, initial_states: names }) => names.map((name) => `${path}/${name}`)),
    );
    for (const [key, part] of this.parts ?? []) {
      part.classList.toggle("active", active.has(key));
      part.classList.toggle("initial", initial.has(key));
      part.classList.toggle(
        "selected",
        this.selected !== null &&
          key === (this.selected.state === null ? this.selected.path : `${this.selected.path}/${this.selected.state}`),
      );
    }
    const paths = [...active].filter((key) => ![...active].some((other) => other.startsWith(`${key}/`)));
    setText(
      this.now,
      paths.length
        ? t("now: {states}", { states: paths.join(", ") })
        : this.statuses.size
          ? t("no state is active")
          : "",
    );
  }

  // --- details

  showDetails() {
    const path = this.selected?.path ?? roots(this.structures)[0];
    const structure = this.structures.get(path);
    const status = this.statuses.get(path);
    const content = JSON.stringify([
      path,
      this.selected?.state ?? null,
      status && { ...status, header: null, info: null },
      this.events.length,
      this.events[0]?.seconds ?? 0,
      structure?.children,
      [...this.folded],
      this.link.mayWrite,
    ]);
    if (content === this.shown) return;
    this.shown = content;
    if (!structure) {
      refill(
        this.details,
        h("p", { class: "muted" }, t("A click on a state or a container shows its outcomes and its userdata.")),
      );
      return;
    }
    const state = this.selected?.state ?? null;
    refill(
      this.details,
      h("h2", {}, state === null ? path : `${path}/${state}`),
      this.facts(structure, status, state),
      h("h3", {}, t("Userdata of {path}", { path })),
      this.userdata(status),
      h("h3", {}, "Last changes"),
      this.events.length
        ? h(
            "ul",
            { class: "smach-events" },
            this.events
              .slice(0, 30)
              .map((event) =>
                h(
                  "li",
                  {},
                  h("span", { class: "muted num" }, new Date(event.seconds * 1000).toLocaleTimeString(language)),
                  " ",
                  h("span", { class: "muted" }, event.path),
                  " → ",
                  event.active.join(", ") || t("ended"),
                ),
              ),
          )
        : h("p", { class: "muted" }, t("none yet")),
    );
  }

  facts(structure, status, state) {
    const { path } = structure;
    const key = state === null ? path : `${path}/${state}`;
    const isContainer = this.structures.has(key);
    const transitions = structure.outcomes_from
      .map((from, index) => [from, structure.internal_outcomes[index], structure.outcomes_to[index]])
      .filter(([from]) => state === null || from === state);
    const fold =
      isContainer && key !== roots(this.structures)[0]
        ? h(
            "button",
            {
              type: "button",
              class: "small",
              onclick: () => {
                if (!this.folded.delete(key)) this.folded.add(key);
                this.shown = null;
                this.draw();
              },
            },
            this.folded.has(key) ? t("unfold") : t("fold"),
          )
        : null;
    const begin =
      state === null
        ? null
        : h(
            "button",
            {
              type: "button",
              class: "small",
              disabled: !this.link.mayWrite,
              title: "The container starts with this state the next time that it is run",
              onclick: () => this.setInitial(path, state),
            },
            t("start here next time"),
          );
    return [
      h("div", { class: "bar" }, begin, fold),
      state === null
        ? h(
            "p",
            { class: "muted" },
            t("outcomes: {names}", { names: structure.container_outcomes.join(", ") || t("none") }),
          )
        : null,
      status
        ? h(
            "p",
            {},
            t("active: {names}", { names: activeOf(status).join(", ") || t("none") }),
            h("br"),
            h(
              "span",
              { class: "muted" },
              t("starts with: {names}", { names: status.initial_states.join(", ") || "–" }),
            ),
          )
        : null,
      h(
        "table",
        { class: "values" },
        h(
          "tbody",
          {},
          transitions.map(([from, label, to]) =>
            h(
              "tr",
              {},
              state === null ? h("td", {}, from) : null,
              h("th", { scope: "row" }, label),
              h("td", {}, `→ ${to}`),
            ),
          ),
        ),
      ),
    ];
  }

  userdata(status) {
    if (!status) return h("p", { class: "muted" }, t("not known yet"));
    try {
      const rows = userdataOf(status.local_data);
      if (!rows.length) return h("p", { class: "muted" }, t("empty"));
      return h(
        "table",
        { class: "values" },
        h(
          "tbody",
          {},
          rows.map(([name, text]) => h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, text))),
        ),
      );
    } catch (error) {
      return h("p", { class: "muted" }, t("it cannot be read: {why}", { why: error.message }));
    }
  }

  async setInitial(path, state) {
    // Again until the machine has answered: a message that comes before its connection is lost.
    const { server } = this;
    const isDone = () => this.statuses.get(path)?.initial_states.join() === state;
    for (
      let number = 0;
      number < MAX_SENDS && (number === 0 || !isDone()) && server === this.server && !this.isClosed;
      number++
    ) {
      try {
        await this.link.publish(`${server}/smach/container_init`, INIT, INIT_TEXT, {
          path,
          initial_states: [state],
          local_data: EMPTY_USERDATA,
        });
        setText(this.problem, "");
      } catch (error) {
        setText(this.problem, error.message);
        return;
      }
      await new Promise((resolve) => {
        setTimeout(resolve, SEND_MS);
      });
    }
  }
}
