// A list of many rows of one height, of which only those that are seen are elements.

import { h } from "./dom.js";

const EXTRA = 6; // rows above and below what is seen
const USUAL_HEIGHT = 26; // pixels, until a row is there

export class VirtualList {
  /**
   * make() returns an element for a row, show(element, index) fills it. The style sets the height of rows, by the width
   * of the view.
   */
  constructor(make, show) {
    this.rowHeight = USUAL_HEIGHT;
    this.make = make;
    this.showRow = show;
    this.count = 0;
    this.isFollowing = true;
    this.followed = 0; // where it last scrolled by itself
    this.pool = [];
    this.space = h("div", { class: "space" });
    this.element = h(
      "div",
      { class: "virtual", role: "group", tabindex: "0", onscroll: () => this.scrolled() },
      this.space,
    );
    this.observer = new ResizeObserver(() => this.measure());
    this.observer.observe(this.element);
  }

  close() {
    this.observer.disconnect();
  }

  /** Show this many rows; those that are on the screen are filled again. */
  update(count) {
    this.count = count;
    this.space.style.height = `${count * this.rowHeight}px`;
    if (this.isFollowing) this.scrollToEnd();
    this.draw();
  }

  scrollToEnd() {
    this.element.scrollTop = this.count * this.rowHeight;
    this.followed = this.element.scrollTop - 1; // a browser rounds it
  }

  follow() {
    this.isFollowing = true;
    this.update(this.count);
  }

  /** Keep the rows that are seen where they are when rows in front of them are removed. */
  removed(rows) {
    if (!this.isFollowing) this.element.scrollTop = Math.max(0, this.element.scrollTop - rows * this.rowHeight);
  }

  scrolled() {
    const { scrollTop, clientHeight } = this.element;
    // The end may have moved before the event of the list's own scrolling comes: a person who leaves it scrolls up.
    if (scrollTop + clientHeight >= this.count * this.rowHeight - this.rowHeight) this.isFollowing = true;
    else if (scrollTop < this.followed) this.isFollowing = false;
    this.draw();
  }

  /** Draw rows of the height that the style gives them in this width. */
  measure() {
    const height = this.pool.find((row) => !row.hidden)?.offsetHeight;
    if (height) this.rowHeight = height;
    this.update(this.count);
  }

  draw() {
    const isFirst = !this.pool.length;
    const { scrollTop, clientHeight } = this.element;
    const first = Math.max(0, Math.floor(scrollTop / this.rowHeight) - EXTRA);
    const last = Math.min(this.count, Math.ceil((scrollTop + clientHeight) / this.rowHeight) + EXTRA);
    while (this.pool.length < last - first) {
      const row = this.make();
      this.pool.push(row);
      this.space.append(row);
    }
    this.pool.forEach((row, number) => {
      const index = first + number;
      row.hidden = index >= last;
      if (row.hidden) return;
      row.style.transform = `translateY(${index * this.rowHeight}px)`;
      this.showRow(row, index);
    });
    if (isFirst && this.pool.length && this.pool[0].offsetHeight !== this.rowHeight) this.measure();
  }
}
