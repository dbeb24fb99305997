// Which interactive markers a server has, by the numbers of its updates: a lost update is noticed, and all markers are
// fetched again. Pure.
// Source: http://wiki.ros.org/rviz/Tutorials/Interactive%20Markers%3A%20Getting%20Started,
// visualization_msgs/InteractiveMarkerUpdate.

import { t } from "../texts.js";

const KEEP_ALIVE = 0;
const MAX_SERVERS = 20; // of one namespace
const MAX_WAITING = 100; // updates that came before all markers did
const QUIET_MS = 2000; // servers publish every half second

export class MarkerUpdates {
  constructor() {
    // server_id -> {sequence: null until all its markers are known, full, waiting, updated: the time of the last
    // update}
    this.servers = new Map();
  }

  /** Return whether a server's markers are not known. */
  get isWaiting() {
    return !this.servers.size || [...this.servers.values()].some(({ sequence }) => sequence === null);
  }

  /** Take over an InteractiveMarkerInit; return the changes: [{server, isAll, markers, poses, erases}]. */
  full(message) {
    const known = this.server(message.server_id);
    if (known.sequence !== null) return [];
    known.full = message;
    return this.settle(known);
  }

  /** Take over an InteractiveMarkerUpdate that came at a time in milliseconds; return the changes. */
  update(message, now) {
    const known = this.server(message.server_id);
    known.updated = now;
    if (known.sequence !== null) return this.next(known, message);
    known.waiting.push(message);
    if (known.waiting.length > MAX_WAITING) known.waiting.shift();
    return this.settle(known);
  }

  /** Return [level, text] by server. */
  statuses(now) {
    return [...this.servers].map(([id, { sequence, lost, updated }]) => {
      if (now - updated > QUIET_MS)
        return [id, [1, t("No update received for {count} seconds.", { count: Math.round((now - updated) / 1000) })]];
      return [id, sequence === null ? [1, lost || t("Waiting for all markers.")] : [0, "OK"]];
    });
  }

  server(id) {
    if (!this.servers.has(id)) {
      if (this.servers.size >= MAX_SERVERS)
        throw new Error(
          t('more than {count} servers: "{name}" is left out', { count: MAX_SERVERS, name: id.slice(0, 200) }),
        );
      this.servers.set(id, { id, sequence: null, full: null, waiting: [], updated: Infinity, lost: "" });
    }
    return this.servers.get(id);
  }

  next(known, message) {
    const isAlive = message.type === KEEP_ALIVE;
    const expected = known.sequence + (isAlive ? 0 : 1);
    if (message.seq_num !== expected) {
      Object.assign(known, { sequence: null, full: null, waiting: [message] });
      const text = isAlive
        ? "Sequence number of keep-alive is out of order. Expected: {expected} Received: {found}"
        : "Sequence number of update is out of order. Expected: {expected} Received: {found}";
      known.lost = t(text, { expected, found: message.seq_num });
      return [];
    }
    known.sequence = expected;
    return isAlive
      ? []
      : [{ server: known.id, isAll: false, markers: message.markers, poses: message.poses, erases: message.erases }];
  }

  /** Start from all markers, if the updates that came before and after join them without a gap. */
  settle(known) {
    const { full, waiting } = known;
    if (!full || !waiting.length || waiting.at(-1).seq_num < full.seq_num) return [];
    const later = waiting.filter(({ seq_num: number }) => number > full.seq_num);
    if (later.length && (later[0].type === KEEP_ALIVE || later[0].seq_num !== full.seq_num + 1)) return [];
    Object.assign(known, { sequence: full.seq_num, full: null, waiting: [], lost: "" });
    const found = [{ server: known.id, isAll: true, markers: full.markers, poses: [], erases: [] }];
    for (const message of later)
      found.push(...(known.sequence === null ? this.update(message, known.updated) : this.next(known, message)));
    return found;
  }
}
