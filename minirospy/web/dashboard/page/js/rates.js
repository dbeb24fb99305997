// The rate of messages over the last seconds, by counts that come in batches. Pure.

const WINDOW = 3; // seconds

export class Rate {
  constructor() {
    this.first = null;
    this.parts = []; // [time, count, bytes]
    this.total = 0;
    this.firstBytes = 0;
  }

  add(now, count, bytes) {
    this.first ??= now;
    if (!this.total && count) this.firstBytes = bytes / count;
    this.total += count;
    this.parts.push([now, count, bytes]);
  }

  /** Return {hz, bytes} a second until now; null before the first message, and where too little is known. */
  at(now) {
    while (this.parts.length && this.parts[0][0] < now - WINDOW) this.parts.shift();
    // One message alone, as of a topic that is latched, has no rate.
    if (this.first === null || this.total < 2) return null;
    const span = Math.min(WINDOW, now - this.first);
    // The first message starts the time, so it does not count.
    const isYoung = now - this.first < WINDOW;
    if (span < 0.5) return null;
    let count = isYoung ? -1 : 0;
    let bytes = isYoung ? -this.firstBytes : 0;
    for (const [, each, size] of this.parts) {
      count += each;
      bytes += size;
    }
    return { hz: Math.max(0, count) / span, bytes: Math.max(0, bytes) / span };
  }
}
