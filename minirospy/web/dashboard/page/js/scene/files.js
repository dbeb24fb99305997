// .rviz files: the server reads and writes their YAML; the file of the command (`rviz -d FILE`) is saved there, others
// by the browser.

import { download, h } from "../dom.js";
import { t } from "../texts.js";
import { writeView } from "./config.js";

const PROTOCOL = "minirospy.rviz.v1";
const MAX_BYTES = 200_000;

/** Send one operation to the server; return a promise of its answer. */
function requested(link, operation) {
  return new Promise((resolve, reject) => {
    const socket = new WebSocket(link.address(), link.protocols(PROTOCOL));
    socket.onopen = () => socket.send(JSON.stringify(operation));
    socket.onmessage = ({ data }) => {
      const answer = JSON.parse(data);
      if (answer.error) reject(new Error(answer.error));
      else resolve(answer);
      socket.close();
    };
    socket.onclose = () => reject(new Error(t("the connection is lost")));
  });
}

export class Files {
  constructor(view) {
    this.view = view;
    this.name = "";
    this.mayWrite = false;
    this.field = h("input", { type: "file", accept: ".rviz,.yaml,.yml", hidden: true, onchange: () => this.chosen() });
    this.saveButton = h(
      "button",
      { type: "button", class: "small", hidden: true, onclick: () => this.run(() => this.save()) },
      "Save",
    );
    this.element = h(
      "span",
      { class: "files" },
      this.field,
      h(
        "button",
        { type: "button", class: "small", title: "Open a .rviz file", onclick: () => this.field.click() },
        "Open",
      ),
      this.saveButton,
      h(
        "button",
        { type: "button", class: "small", title: "Save as a .rviz file", onclick: () => this.run(() => this.saveAs()) },
        "Save as",
      ),
    );
  }

  async run(work) {
    try {
      await work();
    } catch (error) {
      this.view.say(error.message, true);
    }
  }

  /** Open the file of the command. */
  read() {
    return this.run(async () => {
      const { config, name, writes } = await requested(this.view.link, { read: true });
      this.name = name;
      this.mayWrite = writes;
      this.saveButton.hidden = !writes;
      this.saveButton.title = t("Save to {name}", { name });
      if (config) this.view.open(config);
      else this.view.say(t("{name} does not exist: Save makes it", { name }));
    });
  }

  chosen() {
    const [file] = this.field.files;
    this.field.value = "";
    if (!file) return undefined;
    return this.run(async () => {
      if (file.size > MAX_BYTES)
        throw new Error(
          t("{name}: {size} bytes, {most} are allowed", { name: file.name, size: file.size, most: MAX_BYTES }),
        );
      const { config } = await requested(this.view.link, { parse: await file.text() });
      this.view.open(config);
      this.name ||= file.name;
    });
  }

  /** Return what is shown as the contents of a file. */
  contents() {
    const { config, stage, context } = this.view;
    writeView(config.view, stage.view);
    const raw = structuredClone(config.raw);
    // RViz has no automatic frame.
    raw["Visualization Manager"]["Global Options"]["Fixed Frame"] ||= context.fixedFrame;
    return raw;
  }

  async save() {
    const { name } = await requested(this.view.link, { save: this.contents() });
    this.view.say(t("saved {name}", { name }));
  }

  async saveAs() {
    const { text } = await requested(this.view.link, { format: this.contents() });
    const name = (this.name || "view.rviz").replace(/^.*[/\\]/, "");
    download(name, new Blob([text], { type: "text/yaml" }));
    this.view.say(t("saved as {name}", { name }));
  }
}
