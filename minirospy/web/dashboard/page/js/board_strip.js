// A board in one line: its lights and buttons, which can be pressed.

import { h, setText } from "./dom.js";
import { t } from "./texts.js";

const RETRY_MS = 3000;

export class BoardStrip {
  constructor(link, name) {
    this.link = link;
    this.name = name;
    this.lights = new Map();
    this.buttons = new Map();
    this.row = h("span", { class: "strip" });
    this.problem = h("span", { class: "error" });
    this.element = h(
      "div",
      { class: "strip-row" },
      h("a", { href: `#/board?board=${encodeURIComponent(name)}` }, name),
      this.row,
      this.problem,
    );
    this.connect();
  }

  close() {
    this.isClosed = true;
    clearTimeout(this.timer);
    this.socket.close();
  }

  connect() {
    this.socket = new WebSocket(
      this.link.address(`?board=${encodeURIComponent(this.name)}`),
      this.link.protocols("minirospy.board.v1"),
    );
    this.socket.onmessage = ({ data }) => this.received(JSON.parse(data));
    this.socket.onclose = () => {
      if (!this.isClosed) this.timer = setTimeout(() => this.connect(), RETRY_MS);
    };
  }

  received({ error, leds, buttons, writes }) {
    setText(this.problem, error ?? "");
    if (error) return;
    for (const [pin, color, level] of leds) {
      let light = this.lights.get(pin);
      if (!light) {
        light = h("span", { class: `led ${color}`, role: "img" });
        this.lights.set(pin, light);
        this.row.append(light);
      }
      light.classList.toggle("lit", level === 1);
      light.setAttribute("aria-label", `LED GPIO ${pin} ${t(color)} ${level ? t("on") : t("off")}`);
      light.title = light.getAttribute("aria-label");
    }
    for (const [pin, level] of buttons) {
      let button = this.buttons.get(pin);
      if (!button) {
        button = this.makeButton(pin);
        this.buttons.set(pin, button);
        this.row.append(button);
      }
      button.disabled = !writes;
      button.setAttribute("aria-pressed", String(level === 1));
    }
  }

  makeButton(pin) {
    const send = (operation) => {
      if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(operation));
    };
    const release = () => send({ release: pin });
    return h(
      "button",
      {
        type: "button",
        class: "small",
        title: t("Hold: button of GPIO {pin}", { pin }),
        onpointerdown: () => send({ press: pin }),
        onpointerup: release,
        onpointerleave: release,
        onpointercancel: release,
        onkeydown: ({ key, repeat }) => {
          if (!repeat && (key === " " || key === "Enter")) send({ press: pin });
        },
        onkeyup: release,
        onblur: release,
      },
      `GPIO ${pin}`,
    );
  }
}
