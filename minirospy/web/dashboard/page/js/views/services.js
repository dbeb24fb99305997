// Services: a form for the request, and the response.

import { fill, h, quoted, setText } from "../dom.js";
import { MessageForm } from "../form.js";
import { isList } from "../ros1.js";
import { t } from "../texts.js";

export class Services {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.name = words.get("service") ?? "";
    this.type = null;
    this.calls = 0; // the last one's number
    this.form = null;
    this.choice = h("select", {
      class: "grow",
      "aria-label": "Service",
      onchange: () => this.choose(this.choice.value),
    });
    this.about = h("span", { class: "muted" });
    this.fields = h("div", {});
    this.button = h("button", { type: "submit", class: "primary", hidden: true }, "Call");
    this.answer = h("pre", { class: "answer", "aria-live": "polite" });
    main.append(
      h("div", { class: "bar" }, this.choice, this.about),
      h(
        "form",
        {
          class: "panel details",
          onsubmit: (event) => {
            event.preventDefault();
            this.call();
          },
        },
        this.fields,
        h("div", { class: "bar" }, this.button),
      ),
      this.answer,
    );
    this.ending = link.watch(["services", "state"], () => this.update());
  }

  close() {
    this.ending();
  }

  update() {
    const names = [...this.link.services.keys()];
    fill(
      this.choice,
      h(
        "option",
        { value: "" },
        names.length ? t("choose a service ({count})", { count: names.length }) : t("no services"),
      ),
      names.map((name) => h("option", { value: name }, name)),
    );
    const service = this.link.services.get(this.name);
    if (!service && this.name) this.choice.append(h("option", { value: this.name }, this.name));
    this.choice.value = this.name;
    this.button.disabled = !service;
    if (this.type)
      setText(this.about, `${this.type}${service || this.link.state !== "open" ? "" : t(": it has left")}`);
    if (service && service.type !== this.type) this.show(service);
    else if (!service && this.link.state === "open" && !this.type)
      fill(
        this.fields,
        h(
          "p",
          { class: "muted" },
          this.link.mayWrite
            ? "Choose a service: its request becomes a form."
            : "This token is read-only: it calls no services.",
        ),
      );
  }

  choose(name) {
    this.name = name;
    this.type = null;
    this.calls = this.calls + 1;
    this.button.hidden = true;
    fill(this.fields);
    setText(this.answer, "");
    this.place.remember({ service: name });
    this.update();
  }

  show(service) {
    this.type = service.type;
    setText(this.about, service.type);
    const definition = this.link.definition(`${service.type}Request`, service.request);
    if (!definition) return;
    this.form = new MessageForm(definition);
    fill(this.fields, this.form.element);
    this.button.hidden = false;
  }

  async call() {
    this.answer.classList.remove("error");
    // The answer to a call before this one, or of another service, is not that of this form.
    const call = (this.calls = this.calls + 1);
    try {
      const request = this.form.value();
      setText(this.answer, t("waiting for the answer …"));
      const response = await this.link.call(this.name, request);
      if (call !== this.calls) return;
      setText(this.answer, yaml(response) || t("done: the answer has no fields"));
    } catch (error) {
      if (call !== this.calls) return;
      this.answer.classList.add("error");
      setText(this.answer, error.message);
    }
  }
}

/** Return a message as rosservice prints it. */
export function yaml(value, indent = "") {
  if (value !== null && typeof value === "object" && !isList(value)) {
    return Object.entries(value)
      .map(([name, each]) =>
        each !== null && typeof each === "object" && !isList(each)
          ? `${indent}${name}:\n${yaml(each, `${indent}  `)}`
          : `${indent}${name}: ${plain(each)}`,
      )
      .join("\n");
  }
  return `${indent}${plain(value)}`;
}

function plain(value) {
  if (value !== null && typeof value === "object")
    return JSON.stringify(Array.from(value), (_, each) => (typeof each === "bigint" ? String(each) : each));
  return typeof value === "string" ? quoted(value) : String(value);
}
