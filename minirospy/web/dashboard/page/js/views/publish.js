// Publishing: a form for a message of a topic, once or at a rate.

import { fill, h, setText } from "../dom.js";
import { MessageForm } from "../form.js";
import { t } from "../texts.js";

const LEAST_MS = 10;
const NEW = "new"; // of the choice; names of topics have a slash

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
    this.isNew = false;
    this.name = h("input", {
      class: "grow",
      placeholder: "/name",
      "aria-label": "Name of the new topic",
      autocomplete: "off",
      onchange: () => this.choose(this.name.value.trim()),
    });
    this.typeName = h("input", {
      class: "grow",
      placeholder: "its type, as geometry_msgs/Twist",
      "aria-label": "Its type",
      autocomplete: "off",
      onchange: () => this.describe(this.typeName.value.trim()),
    });
    this.fresh = h("div", { class: "bar", hidden: true }, this.name, this.typeName);
    this.fields = h("div", {});
    this.once = h("button", { type: "submit", class: "primary" }, "Publish once");
    this.repeat = h("button", { type: "button", "aria-pressed": "false", onclick: () => this.toggle() }, "Repeat");
    this.rate = h("input", {
      type: "number",
      min: 0.1,
      max: 100,
      step: "any",
      value: "10",
      "aria-label": "Times a second",
    });
    this.buttons = h(
      "div",
      { class: "bar", hidden: true },
      this.once,
      this.repeat,
      h("label", {}, this.rate, "times a second"),
    );
    this.result = h("p", { role: "status" });
    main.append(
      h("div", { class: "bar" }, this.choice, this.about),
      this.fresh,
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
        h("div", { class: "form-foot" }, this.buttons, this.result),
      ),
    );
    this.ending = link.watch(["channels", "state", "graph"], () => this.update());
  }

  close() {
    this.stop();
    this.ending();
    if (this.sent) this.link.unpublish(this.topic);
  }

  update() {
    const names = [...new Set([...this.link.channels.keys(), ...this.link.graph.subscribed.keys()])].sort();
    if (names.join(" ") !== this.names) {
      this.names = names.join(" ");
      fill(
        this.choice,
        h("option", { value: "" }, "choose a topic"),
        names.map((name) => h("option", { value: name }, name)),
        h("option", { value: NEW }, "another topic …"),
      );
    }
    this.choice.value = names.includes(this.topic) ? this.topic : this.isNew || this.topic ? NEW : "";
    const channel = this.link.channels.get(this.topic);
    if (this.link.state !== "open") this.stop();
    const isOpen = this.link.state === "open" && this.link.mayWrite;
    this.fresh.hidden = !isOpen || Boolean(channel) || !(this.isNew || this.topic);
    this.name.hidden = this.choice.value !== NEW;
    if (isOpen && this.topic && !channel && !this.schema && this.asked !== this.topic) this.describe("");
    // A form that is in use stays: the channel may be that of its own messages.
    if (channel && channel.schema !== this.schema && !this.sent) this.show(channel);
    else if (!this.schema)
      fill(
        this.fields,
        h(
          "p",
          { class: "muted" },
          this.link.state !== "open" || this.link.mayWrite
            ? "Choose a topic: its type becomes a form."
            : "This token is read-only: it publishes nothing.",
        ),
      );
  }

  choose(topic) {
    this.isNew = topic === NEW;
    if (this.isNew) topic = "";
    else if (topic && !topic.startsWith("/")) topic = `/${topic}`;
    this.asked = null;
    this.typeName.value = "";
    this.name.value = topic;
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
    if (this.isNew) this.name.focus();
  }

  /**
   * Make the form of a topic that nobody publishes, of this type; if it is empty, of the one that subscribers have.
   */
  async describe(type) {
    const { topic } = this;
    this.asked = topic;
    setText(this.result, "");
    this.result.classList.remove("error");
    try {
      const { name, definition } = await this.link.tools.request({
        do: "type",
        ...(type ? { name: type } : { topic }),
      });
      if (topic !== this.topic || this.link.channels.has(topic)) return;
      this.typeName.value = name;
      this.show({ type: name, schema: definition });
    } catch (error) {
      // What nobody knows, a person types.
      if (!type || topic !== this.topic) return;
      this.result.classList.add("error");
      setText(this.result, error.message);
    }
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
