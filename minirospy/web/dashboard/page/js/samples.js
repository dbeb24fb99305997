// The points of one plotted series, and what is drawn of many: exact points, or the extremes of each column of pixels.
// Pure.

const FIRST = 1024;
export const MAX_POINTS = 4_000_000; // of one series; then the oldest quarter goes
const MAX_EXACT = 6000; // points of all series that are drawn as they are

export class Samples {
  constructor() {
    this.times = new Float64Array(FIRST);
    this.values = new Float64Array(FIRST);
    this.stamps = null; // times of the headers, of messages that have them
    this.count = 0;
    this.total = 0; // that ever came
  }

  append(times, values, stamps = null) {
    this.total += times.length;
    if (this.count + times.length > MAX_POINTS)
      this.drop(Math.max(MAX_POINTS / 4, this.count + times.length - MAX_POINTS));
    if (stamps) this.stamps ??= this.times.slice();
    if (this.count + times.length > this.times.length) {
      const size = Math.max(this.times.length * 2, this.count + times.length);
      for (const name of this.names) {
        const longer = new Float64Array(size);
        longer.set(this[name].subarray(0, this.count));
        this[name] = longer;
      }
    }
    this.times.set(times, this.count);
    this.values.set(values, this.count);
    this.stamps?.set(stamps ?? times, this.count);
    this.count += times.length;
  }

  drop(count) {
    const gone = Math.min(count, this.count);
    for (const name of this.names) this[name].copyWithin(0, gone, this.count);
    this.count -= gone;
  }

  get names() {
    return this.stamps ? ["times", "values", "stamps"] : ["times", "values"];
  }

  get last() {
    return this.count ? this.values[this.count - 1] : null;
  }

  get lastTime() {
    return this.count ? this.times[this.count - 1] : -Infinity;
  }

  get firstTime() {
    return this.count ? this.times[0] : Infinity;
  }

  /** Return the index of the first point at or after a time. */
  indexOf(time) {
    let low = 0;
    let high = this.count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}

const finite = (value) => (Number.isFinite(value) ? value : null);

/** Return [xs, ys of each series] for a range of time, by at most two points a column; x is relative to ``origin``. */
export function drawn(all, from, to, columns, origin) {
  const ranges = all.map((samples) => [
    Math.max(0, samples.indexOf(from) - 1),
    Math.min(samples.count, samples.indexOf(to) + 1),
  ]);
  const total = ranges.reduce((sum, [first, last]) => sum + last - first, 0);
  return total <= MAX_EXACT
    ? exact(all, ranges, total, origin)
    : extremes(all, ranges, from, to, Math.max(1, Math.floor(columns)), origin);
}

function exact(all, ranges, total, origin) {
  const times = new Float64Array(total);
  let count = 0;
  all.forEach((samples, number) => {
    const part = samples.times.subarray(...ranges[number]);
    times.set(part, count);
    count += part.length;
  });
  times.sort();
  const xs = [];
  for (const time of times) if (!xs.length || time - origin !== xs[xs.length - 1]) xs.push(time - origin);
  const found = [xs];
  all.forEach((samples, number) => {
    const [first, last] = ranges[number];
    const ys = new Array(xs.length);
    let at = first;
    for (let column = 0; column < xs.length; column++) {
      ys[column] = undefined;
      // Of several points at one time the last one counts.
      while (at < last && samples.times[at] - origin <= xs[column]) ys[column] = finite(samples.values[at++]);
    }
    found.push(ys);
  });
  return found;
}

function extremes(all, ranges, from, to, columns, origin) {
  const width = (to - from) / columns;
  const xs = new Array(columns * 2);
  for (let column = 0; column < columns; column++) {
    xs[column * 2] = from + (column + 0.25) * width - origin;
    xs[column * 2 + 1] = from + (column + 0.75) * width - origin;
  }
  const found = [xs];
  all.forEach((samples, number) => {
    const [first, last] = ranges[number];
    const ys = new Array(columns * 2).fill(undefined);
    let index = first;
    for (let column = 0; column < columns; column++) {
      const end = from + (column + 1) * width;
      let low = Infinity;
      let high = -Infinity;
      let lowAt = -1;
      let highAt = -1;
      for (; index < last && (samples.times[index] < end || column === columns - 1); index++) {
        const value = samples.values[index];
        if (value < low) [low, lowAt] = [value, index];
        if (value > high) [high, highAt] = [value, index];
      }
      if (lowAt < 0) continue;
      ys[column * 2] = finite(lowAt <= highAt ? low : high);
      ys[column * 2 + 1] = finite(lowAt <= highAt ? high : low);
    }
    found.push(ys);
  });
  return found;
}

/** Return all points as CSV: a row for each time, a column for each series. */
export function csv(labels, all) {
  const ranges = all.map((samples) => [0, samples.count]);
  const total = all.reduce((sum, samples) => sum + samples.count, 0);
  const [xs, ...columns] = exact(all, ranges, total, 0);
  const rows = [["time", ...labels].map((label) => `"${label.replaceAll('"', '""')}"`).join(",")];
  for (let row = 0; row < xs.length; row++)
    rows.push([xs[row].toFixed(9), ...columns.map((ys) => ys[row] ?? "")].join(","));
  return rows.join("\r\n") + "\r\n";
}
