// The time axis of a timeline: a range of seconds on a width of pixels. Pure.

const CLOSEST = 1e-4; // seconds that the whole width shows at least

export class Axis {
  constructor(length, width) {
    this.length = Math.max(length, CLOSEST);
    this.width = width;
    this.start = 0;
    this.end = this.length;
  }

  get span() {
    return this.end - this.start;
  }

  x(time) {
    return ((time - this.start) / this.span) * this.width;
  }

  time(x) {
    return Math.min(this.length, Math.max(0, this.start + (x / this.width) * this.span));
  }

  /** Zoom by a factor (below 1: closer); the time at x stays there. */
  zoom(factor, x) {
    const span = Math.min(this.length, Math.max(CLOSEST, this.span * factor));
    const fixed = this.start + (x / this.width) * this.span;
    this.set(fixed - (x / this.width) * span, span);
  }

  pan(pixels) {
    this.set(this.start + (pixels / this.width) * this.span, this.span);
  }

  /** Turn the pages so that a time is seen; return whether anything changed. */
  follow(time) {
    if (time >= this.start && time <= this.end) return false;
    this.set(time - this.span * 0.05, this.span);
    return true;
  }

  fit() {
    this.set(0, this.length);
  }

  set(start, span) {
    this.start = Math.min(Math.max(0, start), this.length - span);
    this.end = this.start + span;
  }

  /** Return times for labels, a round number of seconds apart, about `apart` pixels. */
  ticks(apart = 90) {
    const step = roundStep((this.span * apart) / Math.max(1, this.width));
    const found = [];
    for (let number = Math.ceil(this.start / step - 1e-9); number * step <= this.end + step * 1e-9; number++)
      found.push(Math.max(0, number * step));
    return { step, times: found };
  }
}

/** Return the next larger of 1, 2, 5 · 10^n below a minute, and of round minutes and hours above. */
export function roundStep(seconds) {
  const rounds = [60, 120, 300, 600, 1800, 3600, 7200, 21600, 43200, 86400];
  if (seconds > 30) return rounds.find((each) => each >= seconds) ?? Math.ceil(seconds / 86400) * 86400;
  const power = 10 ** Math.floor(Math.log10(seconds));
  const digit = [1, 2, 5, 10].find((each) => each * power >= seconds * (1 - 1e-9));
  return Math.min(digit * power, seconds > 10 ? 30 : Infinity);
}

/** Return seconds as 1:02:03.4; `step` says how many digits are worth showing. */
export function clockText(seconds, step = 0.001) {
  const digits = step >= 1 ? 0 : Math.min(6, Math.ceil(-Math.log10(step) - 1e-9));
  const whole = Number(seconds.toFixed(digits));
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor((whole % 3600) / 60);
  const rest = (whole % 60).toFixed(digits).padStart(digits ? digits + 3 : 2, "0");
  return hours ? `${hours}:${String(minutes).padStart(2, "0")}:${rest}` : `${minutes}:${rest}`;
}

/** Return bytes for people. */
export function sizeText(bytes) {
  if (bytes < 1000) return `${bytes} B`;
  const [unit, size] = bytes < 1e6 ? ["kB", 1e3] : bytes < 1e9 ? ["MB", 1e6] : ["GB", 1e9];
  return `${(bytes / Number(size)).toFixed(1)} ${unit}`;
}

/** Return heights from 0 to 1 for counts of messages: one message is seen next to thousands. */
export function heights(counts) {
  const most = Math.max(1, ...counts);
  return counts.map((count) =>
    count ? 0.55 + 0.45 * (most > 1 ? Math.log1p(count - 1) / Math.log1p(most - 1) : 1) : 0,
  );
}
