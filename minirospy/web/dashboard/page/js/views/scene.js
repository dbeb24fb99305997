// The 3D view, whose modules and library are loaded when it is opened: other views need neither.

import { fill, h } from "../dom.js";
import { t } from "../texts.js";

export class Scene {
  constructor(link, words, main) {
    this.view = null;
    this.isClosed = false;
    fill(main, h("p", { class: "empty" }, "Loading …"));
    this.load(link, words, main);
  }

  async load(link, words, main) {
    try {
      const { SceneView } = await import("../scene/view.js");
      if (this.isClosed) return;
      fill(main);
      this.view = new SceneView(link, words, main);
    } catch (error) {
      if (!this.isClosed)
        fill(
          main,
          h(
            "p",
            { class: "empty error", role: "alert" },
            t("The 3D view cannot be shown: {why}", { why: error.message }),
          ),
        );
    }
  }

  close() {
    this.isClosed = true;
    this.view?.close();
  }
}
