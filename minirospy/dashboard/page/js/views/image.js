// Images of a topic, raw and compressed: always the newest one; zoom, and the value of a pixel.

import { fill, h, number, setText } from "../dom.js";
import { pixelsOf } from "../pixels.js";
import { Rate } from "../rates.js";
import { t } from "../texts.js";

const TYPES = new Set(["sensor_msgs/Image", "sensor_msgs/CompressedImage"]);

export class Image {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.topic = words.get("topic") ?? "";
    this.rate = new Rate();
    this.end = null;
    this.pixels = null;
    this.isDecoding = false;
    this.next = null; // the newest that came meanwhile
    this.choice = h("select", { class: "grow", "aria-label": "Topic", onchange: () => this.choose(this.choice.value) });
    this.isActual = h("input", { type: "checkbox", onchange: () => this.fit() });
    this.about = h("span", { class: "muted" });
    this.value = h("span", { class: "mono" });
    this.problem = h("p", { class: "error" });
    this.canvas = h("canvas", { class: "image", width: 0, height: 0, onpointermove: (event) => this.point(event), onpointerleave: () => setText(this.value, "") });
    this.empty = h("p", { class: "empty" });
    this.frame = h("div", { class: "panel frame" }, this.canvas, this.empty, this.problem);
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(this.frame);
    main.append(h("div", { class: "bar" }, this.choice, h("label", {}, this.isActual, "actual size"), h("button", { type: "button", onclick: () => this.save() }, "PNG")),
      this.frame, h("div", { class: "bar status" }, this.about, this.value));
    this.ending = link.watch(["channels"], () => this.update());
    this.timer = setInterval(() => this.showAbout(), 500);
  }

  close() {
    this.isClosed = true;
    this.ending();
    this.observer.disconnect();
    clearInterval(this.timer);
    this.end?.();
  }

  update() {
    const topics = [...this.link.channels.values()].filter(({ type }) => TYPES.has(type)).map(({ topic }) => topic);
    if (this.topic && !topics.includes(this.topic)) topics.unshift(this.topic);
    fill(this.choice, h("option", { value: "" }, topics.length ? "choose a topic" : "no topic has images"), topics.map((topic) => h("option", { value: topic }, topic)));
    if (!this.topic && topics.length === 1) this.choose(topics[0]);
    this.choice.value = this.topic;
    if (this.topic && !this.end) this.subscribe();
    setText(this.empty, this.pixels ? "" : this.topic ? t("Waiting for {topic} …", { topic: this.topic }) : t("Start a camera, or play a bag with images."));
  }

  choose(topic) {
    this.topic = topic;
    this.place.remember({ topic });
    this.end?.();
    this.end = null;
    this.pixels = this.next = null;
    this.canvas.width = this.canvas.height = 0;
    this.rate = new Rate();
    if (topic) this.subscribe();
    this.update();
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
        const found = "encoding" in message ? pixelsOf(message) : await decompressed(message);
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
    setText(this.empty, "");
    if (this.canvas.width !== found.width || this.canvas.height !== found.height) {
      this.canvas.width = found.width;
      this.canvas.height = found.height;
      this.fit();
    }
    const context = this.canvas.getContext("2d", { willReadFrequently: Boolean(found.bitmap) });
    if (found.bitmap) context.drawImage(found.bitmap, 0, 0);
    else context.putImageData(new ImageData(found.rgba, found.width, found.height), 0, 0);
    found.bitmap?.close();
    if (this.pointed) this.showValue();
  }

  /** Show the image as large as it fits, or pixel by pixel. */
  fit() {
    const { width, height } = this.canvas;
    if (!width) return;
    const isActual = this.isActual.checked;
    const scale = isActual ? 1 : Math.min((this.frame.clientWidth - 2) / width, (this.frame.clientHeight - 2) / height);
    this.canvas.classList.toggle("large", isActual || scale > 2);
    this.canvas.style.width = `${Math.max(1, width * scale)}px`;
    this.canvas.style.height = `${Math.max(1, height * scale)}px`;
  }

  showAbout() {
    if (!this.pixels) return;
    const { width, height, range } = this.pixels;
    const rate = this.rate.at(performance.now() / 1000);
    setText(this.about, [`${width} × ${height}`, this.message.encoding ?? this.message.format, range ? `${number(range[0])} … ${number(range[1])}` : "",
      rate ? `${rate.hz.toFixed(1)} Hz` : "", this.message.header.frame_id].filter(Boolean).join(" · "));
  }

  point(event) {
    const box = this.canvas.getBoundingClientRect();
    this.pointed = [Math.floor(((event.clientX - box.left) / box.width) * this.canvas.width), Math.floor(((event.clientY - box.top) / box.height) * this.canvas.height)];
    this.showValue();
  }

  showValue() {
    const [x, y] = this.pointed;
    if (!this.pixels || x < 0 || y < 0 || x >= this.pixels.width || y >= this.pixels.height) return;
    const value = this.pixels.at ? this.pixels.at(x, y) : Array.from(this.canvas.getContext("2d").getImageData(x, y, 1, 1).data.subarray(0, 3)).join(" ");
    setText(this.value, `(${x}, ${y}): ${value}`);
  }

  save() {
    if (!this.pixels) return;
    this.canvas.toBlob((blob) => {
      const url = URL.createObjectURL(blob);
      h("a", { href: url, download: "image.png" }).click();
      setTimeout(() => URL.revokeObjectURL(url), 60_000);
    });
  }
}

async function decompressed({ data, format }) {
  let bitmap;
  try {
    bitmap = await createImageBitmap(new Blob([data]));
  } catch {
    throw new Error(t('a compressed image of format "{format}" cannot be shown by this browser', { format }));
  }
  return { width: bitmap.width, height: bitmap.height, bitmap, range: null };
}
