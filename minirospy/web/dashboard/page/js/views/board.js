// The workshop's board: lights, buttons (mouse, touch, keys 1 and 2), and the room of the scanner with a person to
// drag.

import { fill, h, setText, svg } from "../dom.js";
import { t } from "../texts.js";

const SVG_LIGHTS = { green: ["#0d3b1c", "#37e06b"], yellow: ["#44380a", "#ffd84a"], red: ["#451111", "#ff5148"] };
const METRES = 200; // pixels a metre in the room
const REACH = 0.15; // of a person, in metres

export class Board {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.name = words.get("board") ?? "";
    this.state = null;
    this.held = new Set();
    this.socket = null;
    this.isClosed = false;
    this.boards = h("select", { "aria-label": "Board", onchange: () => this.choose(this.boards.value) });
    this.problem = h("span", { class: "error", role: "alert" });
    this.others = h("div", { class: "muted pins" });
    this.picture = svg("svg", { class: "board", viewBox: "0 0 560 300", role: "group", "aria-label": "The board" });
    this.room = svg("svg", {
      class: "room",
      viewBox: "-130 -220 260 260",
      role: "group",
      "aria-label": "The scanner's fields and a person",
    });
    this.awayButton = h(
      "button",
      { type: "button", onclick: () => this.send({ person: this.state?.person ? null : [0.6, 0] }) },
      "Let a person come",
    );
    main.append(
      h("div", { class: "bar" }, h("label", {}, "Board", this.boards), this.problem),
      h(
        "div",
        { class: "boards" },
        h(
          "div",
          { class: "panel" },
          this.picture,
          h("p", { class: "muted hint" }, "Hold a button with the mouse or a finger, or the keys 1 and 2."),
        ),
        h(
          "div",
          { class: "panel" },
          this.room,
          h("div", { class: "bar hint" }, this.awayButton, (this.where = h("span", { class: "muted" }))),
        ),
      ),
      this.others,
    );
    this.onKey = (event) => this.key(event);
    this.onBlur = () => this.releaseAll();
    addEventListener("keydown", this.onKey);
    addEventListener("keyup", this.onKey);
    addEventListener("blur", this.onBlur);
    this.drawBoard();
    this.drawRoom();
    this.connect();
  }

  close() {
    this.isClosed = true;
    clearTimeout(this.timer);
    removeEventListener("keydown", this.onKey);
    removeEventListener("keyup", this.onKey);
    removeEventListener("blur", this.onBlur);
    this.socket?.close();
  }

  choose(name) {
    this.name = name;
    this.place.remember({ board: name });
    this.releaseAll();
    this.isChosen = true;
    // It is connected again, to the other board.
    this.socket.close();
  }

  connect() {
    this.socket = new WebSocket(
      this.link.address(this.name ? `?board=${encodeURIComponent(this.name)}` : ""),
      this.link.protocols("minirospy.board.v1"),
    );
    this.socket.onmessage = ({ data }) => this.received(JSON.parse(data));
    this.socket.onclose = () => {
      this.held.clear();
      if (!this.isClosed) this.timer = setTimeout(() => this.connect(), this.isChosen ? 0 : 1000);
      this.isChosen = false;
    };
  }

  send(operation) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(operation));
  }

  received(state) {
    if (state.error) {
      setText(this.problem, state.error);
      return;
    }
    this.state = state;
    setText(this.problem, state.writes ? "" : t("This token is read-only."));
    const names = [...new Set([...state.boards, state.name])].sort();
    if (names.join() !== this.names) {
      this.names = names.join();
      fill(
        this.boards,
        names.map((name) => h("option", { value: name }, name)),
      );
    }
    this.boards.value = state.name;
    for (const [pin, color, level] of state.leds) {
      const led = this.leds.get(pin);
      led.setAttribute("fill", SVG_LIGHTS[color][level]);
      led.parentNode.classList.toggle("lit", level === 1);
      led.parentNode.setAttribute("aria-label", `LED GPIO ${pin} ${t(color)} ${level ? t("on") : t("off")}`);
    }
    for (const [pin, level] of state.buttons) {
      this.buttons.get(pin).classList.toggle("down", level === 1);
      this.buttons.get(pin).setAttribute("aria-pressed", String(level === 1));
    }
    setText(
      this.others,
      state.pins.length
        ? `${t("Other pins:")} ${state.pins.map(([pin, kind, level]) => `GPIO ${pin} ${kind} ${level}`).join(", ")}`
        : "",
    );
    this.showPerson(state);
  }

  // --- lights and buttons

  drawBoard() {
    const board = svg(
      "g",
      {},
      svg("rect", { x: 8, y: 8, width: 544, height: 284, rx: 16, class: "pcb" }),
      [
        [28, 28],
        [532, 28],
        [28, 272],
        [532, 272],
      ].map(([cx, cy]) => svg("circle", { cx, cy, r: 8, class: "hole" })),
      svg(
        "g",
        { class: "header" },
        svg("rect", { x: 120, y: 22, width: 320, height: 30, rx: 3 }),
        Array.from({ length: 40 }, (_, index) =>
          svg("circle", { cx: 130 + (index % 20) * 15.8, cy: 30 + Math.floor(index / 20) * 14, r: 3.4 }),
        ),
      ),
    );
    this.leds = new Map();
    [
      [2, "green"],
      [3, "green"],
      [4, "yellow"],
      [5, "yellow"],
      [6, "red"],
      [7, "red"],
    ].forEach(([pin, color], index) => {
      const x = 80 + index * 80;
      const glow = svg("circle", { cx: x, cy: 120, r: 34, fill: SVG_LIGHTS[color][1], class: "glow" });
      const led = svg("circle", { cx: x, cy: 120, r: 17, fill: SVG_LIGHTS[color][0], class: "led" });
      this.leds.set(pin, led);
      board.append(
        svg(
          "g",
          { class: "light", role: "img", "aria-label": `LED GPIO ${pin}` },
          glow,
          led,
          svg("circle", { cx: x - 5, cy: 114, r: 4, class: "shine" }),
          svg("text", { x, y: 168 }, `GPIO ${pin}`),
        ),
      );
    });
    this.buttons = new Map();
    [11, 12].forEach((pin, index) => {
      const x = 190 + index * 180;
      const button = svg(
        "g",
        {
          class: "push",
          tabindex: 0,
          role: "button",
          "aria-label": t("Button GPIO {pin}", { pin }),
          "aria-pressed": "false",
        },
        svg("rect", { x: x - 32, y: 192, width: 64, height: 64, rx: 8, class: "frame" }),
        svg("circle", { cx: x, cy: 224, r: 22, class: "cap" }),
        svg("text", { x, y: 229, class: "number" }, String(index + 1)),
        svg("text", { x, y: 276 }, `GPIO ${pin}`),
      );
      button.dataset.pin = pin;
      button.addEventListener("pointerdown", (event) => {
        button.setPointerCapture(event.pointerId);
        this.press(pin);
      });
      for (const name of ["pointerup", "pointercancel"]) button.addEventListener(name, () => this.release(pin));
      this.buttons.set(pin, button);
      board.append(button);
    });
    this.picture.append(board);
  }

  press(pin) {
    if (this.held.has(pin)) return;
    this.held.add(pin);
    this.send({ press: pin });
  }

  release(pin) {
    if (this.held.delete(pin)) this.send({ release: pin });
  }

  releaseAll() {
    for (const pin of [...this.held]) this.release(pin);
  }

  key(event) {
    const focused = /** @type {HTMLElement | null} */ (document.activeElement)?.dataset?.pin;
    const pin =
      { 1: 11, 2: 12 }[event.key] ??
      (focused && (event.key === " " || event.key === "Enter") ? Number(focused) : undefined);
    if (
      pin === undefined ||
      event.repeat ||
      (event.type === "keydown" && !this.place.isActive()) ||
      /INPUT|SELECT|TEXTAREA/.test(document.activeElement?.tagName ?? "")
    )
      return;
    event.preventDefault();
    if (event.type === "keydown") this.press(pin);
    else this.release(pin);
  }

  // --- the room; the scanner is at 0, 0, ahead is up, as on a map

  drawRoom() {
    this.fields = svg("g", {});
    this.labels = svg("g", {});
    this.person = svg(
      "g",
      { class: "person", tabindex: 0, role: "img", "aria-label": "The person: drag, or the arrow keys" },
      svg("circle", { r: REACH * METRES, class: "body" }),
      svg("circle", { r: 9, class: "face" }),
    );
    this.room.append(
      svg("rect", { x: -130, y: -220, width: 260, height: 260, class: "floor" }),
      this.fields,
      svg("rect", { x: -10, y: -8, width: 20, height: 16, rx: 4, class: "scanner" }),
      this.person,
      this.labels,
    );
    const move = (event) => {
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.room.getScreenCTM().inverse());
      const round = (value) => Math.round(value * 1000) / 1000;
      this.wanted = [
        round(Math.min(1.09, Math.max(-0.15, -point.y / METRES))),
        round(Math.min(0.64, Math.max(-0.64, -point.x / METRES))),
      ];
      // The newest position at 30 Hz: a drag makes far more.
      this.moving ??= setTimeout(() => {
        this.moving = null;
        this.send({ person: this.wanted });
      }, 33);
    };
    this.person.addEventListener("pointerdown", (event) => {
      this.person.setPointerCapture(event.pointerId);
      this.isDragged = true;
    });
    this.person.addEventListener("pointermove", (event) => {
      if (this.isDragged) move(event);
    });
    for (const name of ["pointerup", "pointercancel"])
      this.person.addEventListener(name, () => {
        this.isDragged = false;
      });
    this.person.addEventListener("keydown", (event) => {
      const step = { ArrowUp: [0.05, 0], ArrowDown: [-0.05, 0], ArrowLeft: [0, 0.05], ArrowRight: [0, -0.05] }[
        event.key
      ];
      if (!step || !this.state?.person) return;
      event.preventDefault();
      this.send({ person: [this.state.person[0] + step[0], this.state.person[1] + step[1]] });
    });
  }

  showPerson({ person, fields }) {
    const distance = person ? Math.max(0, Math.hypot(...person) - REACH) : Infinity;
    if (!this.fields.children.length) {
      const names = [t("warning field"), t("protective field")];
      this.fields.append(
        ...fields.map((radius, index) => svg("circle", { r: radius * METRES, class: `field f${index}` })),
      );
      this.labels.append(...fields.map((radius, index) => svg("text", { y: -radius * METRES - 5 }, names[index])));
    }
    fields.forEach((radius, index) => this.fields.children[index].classList.toggle("hit", distance < radius));
    this.person.classList.toggle("away", !person);
    if (person) this.person.setAttribute("transform", `translate(${-person[1] * METRES} ${-person[0] * METRES})`);
    setText(this.awayButton, person ? t("Send the person away") : t("Let a person come"));
    const inside =
      distance < fields[1] ? t(": in the protective field") : distance < fields[0] ? t(": in the warning field") : "";
    setText(
      this.where,
      person
        ? t("{ahead} m ahead, {left} m to the left", { ahead: person[0].toFixed(2), left: person[1].toFixed(2) }) +
            inside
        : t("nobody before the scanner"),
    );
  }
}
