// Driving through the server's own endpoint: it publishes what is held, and zero if this page lets go, is lost, or
// is silent for half a second.

const AGAIN_MS = 500;
const MAX_WAITING = 2000; // bytes that the network has not taken; more would arrive late

export class Drive {
  /** react(fields) is called with what the server sends: {writes}, {stopped}, {error, topic}; and {lost: true}. */
  constructor(link, react) {
    this.link = link;
    this.react = react;
    this.isClosed = false;
    this.connect();
  }

  connect() {
    this.socket = new WebSocket(this.link.address(), this.link.protocols("minirospy.drive.v1"));
    this.socket.onmessage = ({ data }) => this.react(JSON.parse(data));
    this.socket.onclose = () => {
      if (this.isClosed) return;
      this.react({ lost: true });
      this.timer = setTimeout(() => this.connect(), AGAIN_MS);
    };
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  /** Send what is held, now or never: a command that arrives late is worse than none. */
  send(fields) {
    if (this.isOpen && this.socket.bufferedAmount < MAX_WAITING) this.socket.send(JSON.stringify(fields));
  }

  close() {
    this.isClosed = true;
    clearTimeout(this.timer);
    this.socket.close();
  }
}
