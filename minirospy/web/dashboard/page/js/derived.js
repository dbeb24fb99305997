// Series that are computed from others while they stream: derivatives, moving averages, one series over another. Pure.

export const KINDS = [
  ["", "as it is"],
  ["derivative", "derivative"],
  ["average1", "average of 1 s"],
  ["average10", "average of 10 s"],
];

/**
 * Return what computes a kind of KINDS, {append(times, values, stamps)}: the values of new points, NaN if there is
 * none yet; null for "".
 */
export function derivedOf(kind) {
  if (kind === "derivative") return new Derivative();
  const seconds = Number(/^average(\d+)$/.exec(kind)?.[1] ?? 0);
  return seconds ? new Average(seconds) : null;
}

class Derivative {
  constructor() {
    this.time = NaN;
    this.value = NaN;
  }

  append(times, values, stamps) {
    // Messages may come in batches: the times of their headers are closer to those of the values.
    const moments = stamps ?? times;
    const found = new Float64Array(moments.length);
    for (let index = 0; index < moments.length; index++) {
      const span = moments[index] - this.time;
      // Messages of the same time have no slope between them. Stamps go back if a bag starts again.
      found[index] = span > 0 ? (values[index] - this.value) / span : NaN;
      if (span !== 0) [this.time, this.value] = [moments[index], values[index]];
    }
    return found;
  }
}

class Average {
  constructor(seconds) {
    this.seconds = seconds;
    this.times = [];
    this.values = [];
    this.first = 0;
    this.sum = 0;
  }

  append(times, values) {
    const found = new Float64Array(times.length);
    for (let index = 0; index < times.length; index++) {
      if (Number.isFinite(values[index])) {
        this.times.push(times[index]);
        this.values.push(values[index]);
        this.sum += values[index];
      }
      while (this.first < this.times.length && this.times[this.first] < times[index] - this.seconds)
        this.sum -= this.values[this.first++];
      if (this.first > 1024 && this.first > this.times.length / 2) this.forget();
      const count = this.times.length - this.first;
      found[index] = count ? this.sum / count : NaN;
    }
    return found;
  }

  /** Drop what is no longer in the window, and what rounding has left in the sum. */
  forget() {
    this.times = this.times.slice(this.first);
    this.values = this.values.slice(this.first);
    this.first = 0;
    this.sum = this.values.reduce((sum, each) => sum + each, 0);
  }
}

/**
 * Return [xs, ys]: a series over another one, by their samples from one time to another; at most ``most`` points, the
 * last one always.
 */
export function pairs(over, samples, from, to, most) {
  const first = samples.indexOf(from);
  const last = samples.indexOf(to + 1e-9);
  const step = Math.max(1, Math.ceil((last - first) / most));
  const xs = [];
  const ys = [];
  let at = Math.max(0, over.indexOf(from) - 1);
  for (let index = first; index < last; index++) {
    if ((last - 1 - index) % step) continue;
    // Of the other series the newest value of that moment.
    while (at + 1 < over.count && over.times[at + 1] <= samples.times[index]) at += 1;
    if (!over.count || over.times[at] > samples.times[index]) continue;
    const [x, y] = [over.values[at], samples.values[index]];
    if (!Number.isFinite(x) || !Number.isFinite(y)) continue;
    xs.push(x);
    ys.push(y);
  }
  return [xs, ys];
}

/** Return the range of an axis for these values, with a margin. */
export function rangeOf(lists) {
  let [low, high] = [Infinity, -Infinity];
  for (const list of lists) {
    for (const value of list) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (low > high) return [0, 1];
  const margin = high > low ? (high - low) * 0.05 : Math.abs(high) * 0.1 || 1;
  return [low - margin, high + margin];
}
