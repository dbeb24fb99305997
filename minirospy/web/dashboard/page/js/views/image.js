// Images of a topic, raw and compressed: always the newest one; zoom, the value of a pixel, and markers over them.

import { decompressed } from "../compressed.js";
import { fill, h, number, setText } from "../dom.js";
import { ImageMarkers } from "../image_markers.js";
import { COLOR_MAPS, pixelsOf } from "../pixels.js";
import { Rate } from "../rates.js";
import { t } from "../texts.js";

const MAX_PIXELS = 40_000; // pixels of the screen, of an image that is zoomed
const TYPES = new Set(["sensor_msgs/Image", "sensor_msgs/CompressedImage"]);
const MARKER_TYPE = "visualization_msgs/ImageMarker";

export class Image {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.topic = words.get("topic") ?? "";
    this.markerTopic = words.get("markers") ?? "";
    this.markers = new ImageMarkers();
    this.rate = new Rate();
    this.end = this.markerEnd = null;
    this.pixels = null;
    this.isDecoding = false;
    this.next = null; // the newest that came meanwhile
    this.choice = h("select", { class: "grow", "aria-label": "Topic", onchange: () => this.choose(this.choice.value) });
    this.markerChoice = h("select", {
      "aria-label": t("Markers over the image"),
      onchange: () => this.chooseMarkers(this.markerChoice.value),
    });
    this.bounds = ["low", "high"].map((name) =>
      h("input", {
        type: "number",
        step: "any",
        value: words.get(name) ?? "",
        placeholder: t("automatic"),
        "aria-label": name === "low" ? "Black at" : "White at",
        onchange: () => this.rescale(),
      }),
    );
    this.mapChoice = h(
      "select",
      { "aria-label": t("Colors of the numbers"), onchange: () => this.rescale() },
      Object.keys(COLOR_MAPS).map((name) => h("option", { value: name }, t(name))),
    );
    this.mapChoice.value = words.get("colors") in COLOR_MAPS ? words.get("colors") : "gray";
    this.scale = h("label", { hidden: true }, t("black to white"), this.bounds, this.mapChoice);
    this.zoomed = null; // pixels of the screen for one of the image; null: as it fits
    this.isActual = h("input", { type: "checkbox", onchange: () => this.unzoom() });
    this.about = h("span", { class: "muted" });
    this.value = h("span", { class: "mono" });
    this.problem = h("p", { class: "error" });
    this.canvas = h("canvas", {
      class: "image",
      role: "img",
      width: 0,
      height: 0,
      onpointermove: (event) => this.point(event),
      onpointerleave: () => setText(this.value, ""),
    });
    this.overlay = h("canvas", { class: "overlay", width: 0, height: 0, "aria-hidden": "true" });
    this.empty = h("p", { class: "empty" });
    this.frame = h(
      "div",
      { class: "panel frame", ondblclick: () => this.unzoom() },
      h("div", { class: "layers" }, this.canvas, this.overlay),
      this.empty,
      this.problem,
    );
    this.frame.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(this.frame);
    main.append(
      h(
        "div",
        { class: "bar" },
        this.choice,
        this.markerChoice,
        h("label", {}, this.isActual, "actual size"),
        this.scale,
        h("button", { type: "button", onclick: () => this.save() }, "PNG"),
      ),
      this.frame,
      h("div", { class: "bar status" }, this.about, this.value),
    );
    this.ending = link.watch(["channels"], () => this.update());
    this.timer = setInterval(() => this.showAbout(), 500);
    this.expiry = setInterval(() => this.markers.expire(performance.now()) && this.drawMarkers(), 100);
  }

  close() {
    this.isClosed = true;
    this.ending();
    this.observer.disconnect();
    clearInterval(this.timer);
    clearInterval(this.expiry);
    this.end?.();
    this.markerEnd?.();
  }

  update() {
    const topics = [...this.link.channels.values()].filter(({ type }) => TYPES.has(type)).map(({ topic }) => topic);
    if (this.topic && !topics.includes(this.topic)) topics.unshift(this.topic);
    fill(
      this.choice,
      h("option", { value: "" }, topics.length ? "choose a topic" : "no topic has images"),
      topics.map((topic) => h("option", { value: topic }, topic)),
    );
    if (!this.topic && topics.length === 1) this.choose(topics[0]);
    this.choice.value = this.topic;
    if (this.topic && !this.end) this.subscribe();
    this.updateMarkers();
    setText(
      this.empty,
      this.pixels
        ? ""
        : this.topic
          ? t("Waiting for {topic} …", { topic: this.topic })
          : topics.length
            ? t("Choose a topic above.")
            : t("Start a camera, or play a bag with images."),
    );
  }

  choose(topic) {
    this.topic = topic;
    this.remember();
    this.end?.();
    this.end = null;
    this.pixels = this.next = null;
    for (const each of [this.canvas, this.overlay]) each.width = each.height = 0;
    this.canvas.setAttribute("aria-label", topic);
    this.rate = new Rate();
    if (topic) this.subscribe();
    this.update();
  }

  remember() {
    const [low, high] = this.bounds.map(({ value }) => value);
    const colors = this.mapChoice.value === "gray" ? "" : this.mapChoice.value;
    this.place.remember({ topic: this.topic, markers: this.markerTopic, low, high, colors });
  }

  // --- markers

  updateMarkers() {
    const topics = [...this.link.channels.values()]
      .filter(({ type }) => type === MARKER_TYPE)
      .map(({ topic }) => topic);
    if (this.markerTopic && !topics.includes(this.markerTopic)) topics.unshift(this.markerTopic);
    fill(
      this.markerChoice,
      h("option", { value: "" }, t("no markers")),
      topics.map((topic) => h("option", { value: topic }, topic)),
    );
    this.markerChoice.value = this.markerTopic;
    this.markerChoice.hidden = !topics.length;
    if (this.markerTopic && !this.markerEnd) this.subscribeMarkers();
  }

  chooseMarkers(topic) {
    this.markerTopic = topic;
    this.remember();
    this.markerEnd?.();
    this.markerEnd = null;
    this.markers = new ImageMarkers();
    this.drawMarkers();
    this.updateMarkers();
  }

  subscribeMarkers() {
    this.markerEnd = this.link.subscribe({ topic: this.markerTopic, mode: "all" }, ({ lines = [], error = "" }) => {
      for (const { message } of lines) {
        try {
          this.markers.process(message, performance.now());
        } catch (failed) {
          error = `${message.ns}/${message.id}: ${failed.message}`;
        }
      }
      setText(this.problem, error);
      this.drawMarkers();
    });
  }

  drawMarkers() {
    const context = this.overlay.getContext("2d");
    context.clearRect(0, 0, this.overlay.width, this.overlay.height);
    this.markers.draw(context);
  }

  // --- images

  rescale() {
    this.remember();
    if (this.pixels?.range) this.show(this.decoded(this.values), this.message);
    this.showAbout();
  }

  decoded(message) {
    this.values = message;
    return pixelsOf(
      message,
      ...this.bounds.map(({ value }) => (value === "" ? null : Number(value))),
      this.mapChoice.value,
    );
  }

  subscribe() {
    this.end = this.link.subscribe({ topic: this.topic, mode: "latest" }, (item) => this.received(item));
  }

  async received(item) {
    this.rate.add(performance.now() / 1000, item.count ?? 0, item.bytes ?? 0);
    if (item.error) {
      setText(this.problem, item.error);
      return;
    }
    this.next = item.message;
    if (this.isDecoding) return;
    this.isDecoding = true;
    while (this.next && !this.isClosed) {
      const [message, { topic }] = [this.next, this];
      this.next = null;
      try {
        const picture = "encoding" in message ? message : await decompressed(message);
        const found = "encoding" in picture ? this.decoded(picture) : picture;
        if (topic === this.topic && !this.isClosed) this.show(found, message);
        else found.bitmap?.close();
        setText(this.problem, "");
      } catch (error) {
        setText(this.problem, error.message);
      }
    }
    this.isDecoding = false;
  }

  show(found, message) {
    this.pixels = found;
    this.message = message;
    this.scale.hidden = !found.range;
    setText(this.empty, "");
    if (this.canvas.width !== found.width || this.canvas.height !== found.height) {
      for (const each of [this.canvas, this.overlay]) [each.width, each.height] = [found.width, found.height];
      this.drawMarkers();
      this.fit();
    }
    const context = this.canvas.getContext("2d", { willReadFrequently: Boolean(found.bitmap) });
    if (found.bitmap) context.drawImage(found.bitmap, 0, 0);
    else context.putImageData(new ImageData(found.rgba, found.width, found.height), 0, 0);
    found.bitmap?.close();
    if (this.pointed) this.showValue();
  }

  unzoom() {
    this.zoomed = null;
    this.fit();
  }

  /** Zoom; what is under the mouse stays there. */
  wheel(event) {
    if (!this.canvas.width) return;
    event.preventDefault();
    const before = this.canvas.getBoundingClientRect();
    const [x, y] = [(event.clientX - before.left) / before.width, (event.clientY - before.top) / before.height];
    this.zoomed = Math.min(
      MAX_PIXELS / Math.max(this.canvas.width, this.canvas.height),
      Math.max(0.05, (before.width / this.canvas.width) * Math.exp(-event.deltaY * 0.0015)),
    );
    this.fit();
    const after = this.canvas.getBoundingClientRect();
    this.frame.scrollBy(after.left + x * after.width - event.clientX, after.top + y * after.height - event.clientY);
  }

  /** Show the image as large as it fits, pixel by pixel, or as large as a person has zoomed. */
  fit() {
    const { width, height } = this.canvas;
    if (!width) return;
    const isActual = this.isActual.checked;
    const scale =
      this.zoomed ??
      (isActual ? 1 : Math.min((this.frame.clientWidth - 2) / width, (this.frame.clientHeight - 2) / height));
    this.canvas.classList.toggle("large", scale === 1 || scale > 2);
    for (const { style } of [this.canvas, this.overlay])
      [style.width, style.height] = [width, height].map((pixels) => `${Math.max(1, pixels * scale)}px`);
  }

  showAbout() {
    if (!this.pixels) return;
    const { width, height, range } = this.pixels;
    const rate = this.rate.at(performance.now() / 1000);
    setText(
      this.about,
      [
        `${width} × ${height}`,
        this.message.encoding ?? this.message.format,
        range ? `${number(range[0])} … ${number(range[1])}` : "",
        rate ? `${rate.hz.toFixed(1)} Hz` : "",
        this.message.header.frame_id,
      ]
        .filter(Boolean)
        .join(" · "),
    );
  }

  point(event) {
    if (event.buttons & 1) this.frame.scrollBy(-event.movementX, -event.movementY);
    const box = this.canvas.getBoundingClientRect();
    this.pointed = [
      Math.floor(((event.clientX - box.left) / box.width) * this.canvas.width),
      Math.floor(((event.clientY - box.top) / box.height) * this.canvas.height),
    ];
    this.showValue();
  }

  showValue() {
    const [x, y] = this.pointed;
    if (!this.pixels || x < 0 || y < 0 || x >= this.pixels.width || y >= this.pixels.height) return;
    const value = this.pixels.at
      ? this.pixels.at(x, y)
      : Array.from(this.canvas.getContext("2d").getImageData(x, y, 1, 1).data.subarray(0, 3)).join(" ");
    setText(this.value, `(${x}, ${y}): ${value}`);
  }

  save() {
    if (!this.pixels) return;
    const picture = h("canvas", { width: this.canvas.width, height: this.canvas.height });
    for (const each of [this.canvas, this.overlay]) picture.getContext("2d").drawImage(each, 0, 0);
    picture.toBlob((blob) => {
      const url = URL.createObjectURL(blob);
      h("a", { href: url, download: "image.png" }).click();
      setTimeout(() => URL.revokeObjectURL(url), 60_000);
    });
  }
}
