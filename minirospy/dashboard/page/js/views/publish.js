// Publishing: a form for a message of a topic, once or at a rate.

import { fill, h, setText } from "../dom.js";
import { MessageForm } from "../form.js";
import { t } from "../texts.js";

const LEAST_MS = 10;

export class Publish {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.topic = words.get("topic") ?? "";
    this.schema = null;
    this.form = null;
    this.timer = null;
    this.sent = 0;
    this.isSending = false;
    this.choice = h("select", { class: "grow", "aria-label": "Topic", onchange: () => this.choose(this.choice.value) });
    this.about = h("span", { class: "muted" });
    this.fields = h("div", {});
    this.once = h("button", { type: "submit", class: "primary" }, "Publish once");
    this.repeat = h("button", { type: "button", "aria-pressed": "false", onclick: () => this.toggle() }, "Repeat");
    this.rate = h("input", { type: "number", min: 0.1, max: 100, step: "any", value: "10", "aria-label": "Times a second" });
    this.buttons = h("div", { class: "bar", hidden: true }, this.once, this.repeat, h("label", {}, this.rate, "times a second"));
    this.result = h("p", { role: "status" });
    main.append(h("div", { class: "bar" }, this.choice, this.about),
      h("form", { class: "panel details", onsubmit: (event) => { event.preventDefault(); this.send(); } }, this.fields, this.buttons), this.result);
    this.ending = link.watch(["channels", "state", "graph"], () => this.update());
  }

  close() {
    this.stop();
    this.ending();
    if (this.sent) this.link.unpublish(this.topic);
  }

  update() {
    const names = [...this.link.channels.keys()];
    if (names.join(" ") !== this.names) {
      this.names = names.join(" ");
      fill(this.choice, h("option", { value: "" }, "choose a topic"), names.map((name) => h("option", { value: name }, name)));
    }
    this.choice.value = this.link.channels.has(this.topic) ? this.topic : "";
    const channel = this.link.channels.get(this.topic);
    if (this.link.state !== "open") this.stop();
    if (channel && channel.schema !== this.schema) this.show(channel);
    else if (!this.schema) fill(this.fields, h("p", { class: "muted" }, this.link.state !== "open" || this.link.mayWrite ? "Choose a topic that is published: its type becomes a form." : "This token is read-only: it publishes nothing."));
  }

  choose(topic) {
    this.stop();
    if (this.sent) this.link.unpublish(this.topic);
    this.topic = topic;
    this.schema = null;
    this.sent = 0;
    this.buttons.hidden = true;
    setText(this.result, "");
    setText(this.about, "");
    this.place.remember({ topic });
    this.update();
  }

  show(channel) {
    const definition = this.link.definition(channel.type, channel.schema);
    if (!definition) return;
    this.schema = channel.schema;
    this.type = channel.type;
    setText(this.about, channel.type);
    this.form = new MessageForm(definition);
    fill(this.fields, this.form.element);
    this.buttons.hidden = false;
  }

  async send() {
    if (this.isSending) return;
    this.isSending = true;
    this.result.classList.remove("error");
    try {
      await this.link.publish(this.topic, this.type, this.schema, this.form.value());
      this.sent += 1;
      setText(this.result, t("{count} published", { count: this.sent }));
    } catch (error) {
      this.result.classList.add("error");
      setText(this.result, error.message);
      this.stop();
    } finally {
      this.isSending = false;
    }
  }

  toggle() {
    if (this.timer) {
      this.stop();
      return;
    }
    this.timer = setInterval(() => this.send(), Math.max(LEAST_MS, 1000 / Math.max(0.1, Number(this.rate.value) || 1)));
    this.repeat.setAttribute("aria-pressed", "true");
    setText(this.repeat, t("Stop"));
    this.send();
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
    this.repeat.setAttribute("aria-pressed", "false");
    setText(this.repeat, t("Repeat"));
  }
}
