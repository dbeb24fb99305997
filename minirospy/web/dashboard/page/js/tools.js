// The page's side of the tools' endpoint: requests that the Foxglove protocol has no message for, and reports that come
// by themselves.

import { t } from "./texts.js";

const RETRY_MS = 1000;
const MAX_REQUEST_LENGTH = 95_000; // characters of a request, as the server's limit

export class Tools {
  constructor(link) {
    this.link = link;
    this.socket = null;
    this.answers = new Map(); // id -> {resolve, reject}
    this.watchers = new Set();
    this.waiting = [];
    this.nextId = 1;
  }

  /** Send a request, {do: NAME, ...}; the promise has its result. */
  request(fields) {
    const id = this.nextId++;
    const text = JSON.stringify({ ...fields, id });
    return new Promise((resolve, reject) => {
      // The server cannot say which request it has not read.
      if (text.length > MAX_REQUEST_LENGTH) throw new Error(t("it is too large"));
      this.answers.set(id, { resolve, reject });
      this.send(text);
    });
  }

  send(text) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(text);
    else {
      this.waiting.push(text);
      this.connect();
    }
  }

  connect() {
    if (this.socket) return;
    const socket = new WebSocket(this.link.address(), this.link.protocols("minirospy.tools.v1"));
    this.socket = socket;
    socket.onopen = () => {
      for (const text of this.waiting.splice(0)) socket.send(text);
    };
    socket.onmessage = ({ data }) => this.received(JSON.parse(data));
    socket.onclose = () => {
      this.socket = null;
      this.waiting = [];
      for (const { reject } of this.answers.values()) reject(new Error("the connection is lost"));
      this.answers.clear();
      if (this.watchers.size) setTimeout(() => this.watchAgain(), RETRY_MS);
    };
  }

  received({ id, result, error, report }) {
    if (report) {
      for (const received of this.watchers) received(report);
      return;
    }
    const answer = this.answers.get(id);
    this.answers.delete(id);
    if (error !== undefined) answer?.reject(new Error(error));
    else answer?.resolve(result);
  }

  /** Call a function with each report of the graph, every few seconds; return what ends it. */
  watch(received) {
    this.watchers.add(received);
    if (this.watchers.size === 1) this.watchAgain();
    return () => {
      this.watchers.delete(received);
      if (!this.watchers.size && this.socket?.readyState === WebSocket.OPEN)
        this.request({ do: "unwatch" }).catch(() => {});
    };
  }

  watchAgain() {
    if (this.watchers.size) this.request({ do: "watch" }).catch(() => {});
  }
}
