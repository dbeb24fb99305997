// Series of bags for a plot: their paths, and the requests for points: first of the whole bag, then of what is shown.

import { Endpoint } from "./endpoint.js";

const PROTOCOL = "minirospy.bag.v1";
const QUIET_MS = 120; // without another zoom, until finer points are requested
const FINER = 4; // times closer than the points that are there
const MINUS = " - ";
const OPERAND = /^(.+?\.(?:bag|mcap)):(\/.*)$/;

/**
 * Return the bag and path of "run.bag:/odom/x", and what is subtracted: with "run.bag:/odom/x - /pose/x" from the
 * same bag, with "a.bag:/odom/x - b.bag:/odom/x" from another one; null for a path of a live topic.
 */
export function bagPathOf(text) {
  const whole = OPERAND.exec(text);
  if (!whole) return null;
  const [, bag, rest] = whole;
  for (let at = rest.indexOf(MINUS); at > 0; at = rest.indexOf(MINUS, at + 1)) {
    const right = rest.slice(at + MINUS.length).trim();
    const other = OPERAND.exec(right);
    const path = rest.slice(0, at).trim();
    if (other) return { bag, path, minus: { bag: other[1], path: other[2] } };
    if (right.startsWith("/")) return { bag, path, minus: { bag, path: right } };
  }
  return { bag, path: rest, minus: null };
}

/** Return the points of a whole bag with those of a part of it in their place; all as {times, values}. */
export function refined(whole, part) {
  const inside = (time) => time >= part.start && time <= part.end;
  const times = [];
  const values = [];
  const add = (points, accepts) =>
    points.times.forEach((time, index) => {
      if (!accepts(time)) return;
      times.push(time);
      values.push(points.values[index] ?? NaN);
    });
  add(whole, (time) => time < part.start);
  add(part, inside);
  add(whole, (time) => time > part.end);
  return { times, values };
}

/** Return whether points of a part of a bag ({start, end, isExact}) are fine enough to show a range of time. */
export function suffices(part, from, to) {
  if (!part || from < part.start || to > part.end) return false;
  return part.isExact || (part.end - part.start) / Math.max(to - from, 1e-9) <= FINER;
}

export class BagPlot {
  /** `handlers`: files(files), fields(fields), shown(key, series), failed(key, text), progress(share), error(text). */
  constructor(link, handlers) {
    this.handlers = handlers;
    this.wanted = new Map(); // key -> {operands, series: label -> {whole, isExact}, isRead}
    this.part = null; // {start, end, isExact}: the part of the bags whose points are finer
    this.shown = null; // {from, to, columns}
    this.asked = null; // the request that is not answered yet
    this.nextId = 1;
    this.endpoint = new Endpoint(link, PROTOCOL, {
      opened: () => {
        this.asked = null;
        this.endpoint.send({ op: "list" });
        if (this.bag) this.endpoint.send({ op: "fields", name: this.bag });
        this.request();
      },
      files: (files) => handlers.files(files.map(([name]) => name)),
      fields: (fields) => handlers.fields(fields),
      series: (answer) => this.answered(answer),
      sampling: ({ id, share }) => {
        if (id === this.asked?.id) handlers.progress(share);
      },
      error: (text) => {
        this.asked = null;
        handlers.error(text);
      },
    });
  }

  close() {
    clearTimeout(this.timer);
    this.endpoint.close();
  }

  list() {
    if (this.endpoint.isOpen) this.endpoint.send({ op: "list" });
  }

  /** Request the topics of a bag. */
  choose(bag) {
    this.bag = bag;
    if (bag && this.endpoint.isOpen) this.endpoint.send({ op: "fields", name: bag });
  }

  add(key, operands) {
    this.wanted.set(key, { operands, series: new Map(), isRead: false });
    this.request();
  }

  remove(key) {
    this.wanted.delete(key);
  }

  /** Show a range of time, with this many columns of pixels: finer points of it come, unless there are no more. */
  show(from, to, columns) {
    this.shown = { from, to, columns };
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.request(), QUIET_MS);
  }

  request() {
    if (this.asked || !this.endpoint.isOpen) return;
    const unread = [...this.wanted].filter(([, { isRead }]) => !isRead);
    if (unread.length) {
      this.send(unread, null, null, 4000);
      return;
    }
    const coarse = [...this.wanted].filter(([, { series }]) => [...series.values()].some(({ isExact }) => !isExact));
    if (!coarse.length || !this.shown) return;
    const { from, to, columns } = this.shown;
    const length = Math.max(...coarse.flatMap(([, { series }]) => [...series.values()].map((each) => each.length)));
    const isWhole = (to - from) * FINER > length;
    if (isWhole || suffices(this.part, from, to)) return;
    const margin = (to - from) / 2;
    this.send(coarse, Math.max(0, from - margin), to + margin, Math.round(columns * 4));
  }

  send(wanted, start, end, columns) {
    this.asked = { id: this.nextId++, start, end, keys: wanted.map(([key]) => key) };
    this.handlers.progress(0);
    const series = wanted.map(([key, { operands }]) => ({ key, ...operands }));
    this.endpoint.send({ op: "series", id: this.asked.id, start, end, columns, series });
  }

  answered({ id, found, errors }) {
    if (id !== this.asked?.id) return;
    const { start, end, keys } = this.asked;
    this.asked = null;
    this.handlers.progress(null);
    if (start !== null) this.part = { start, end, isExact: found.length > 0 && found.every(({ exact }) => exact) };
    for (const key of keys) {
      const known = this.wanted.get(key);
      if (!known) continue;
      known.isRead = true;
      const own = found.filter((each) => each.key === key);
      for (const { label, times, values, count, exact, length } of own) {
        let points = { times, values: values.map((value) => value ?? NaN) };
        let total = count;
        if (start === null) known.series.set(label, { whole: points, isExact: exact, count, length });
        else {
          const series = known.series.get(label);
          if (!series) continue;
          points = refined(series.whole, { start, end, ...points });
          total = series.count;
        }
        this.handlers.shown(key, { label, ...points, count: total });
      }
      if (errors[key]) this.handlers.failed(key, errors[key]);
    }
    this.request();
  }
}
