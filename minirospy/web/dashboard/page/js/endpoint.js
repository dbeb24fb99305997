// A WebSocket to a part of the server with a protocol of its own (bags, launch files, joints): connects again by
// itself, as the link does.

import { t } from "./texts.js";

const FIRST_DELAY_MS = 300;
const MAX_DELAY_MS = 4000;

export class Endpoint {
  /**
   * `handlers`: by the name of the only field of a text message, or of the first; `binary` for binary ones; `opened`,
   * `closed`.
   */
  constructor(link, protocol, handlers) {
    this.link = link;
    this.protocol = protocol;
    this.handlers = handlers;
    this.delay = FIRST_DELAY_MS;
    this.isClosed = false;
    this.connect();
  }

  connect() {
    const socket = new WebSocket(this.link.address(), this.link.protocols(this.protocol));
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.delay = FIRST_DELAY_MS;
      this.handlers.opened?.();
    };
    socket.onmessage = ({ data }) => {
      if (this.isClosed) return;
      if (typeof data !== "string") {
        this.handlers.binary?.(data);
        return;
      }
      const fields = JSON.parse(data);
      const name = Object.keys(fields)[0];
      this.handlers[name]?.(fields[name], fields);
    };
    socket.onclose = () => {
      if (this.isClosed) return;
      this.handlers.closed?.();
      this.timer = setTimeout(() => this.connect(), this.delay);
      this.delay = Math.min(this.delay * 1.6, MAX_DELAY_MS);
    };
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  send(fields) {
    if (this.isOpen) this.socket.send(JSON.stringify(fields));
    else if (!this.isClosed) this.handlers.error?.(t("Not connected: this was not done. Try again in a moment."));
  }

  close() {
    this.isClosed = true;
    clearTimeout(this.timer);
    this.socket.close();
  }
}
