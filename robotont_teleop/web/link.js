// The connection to the server. Every command carries the newest server time that has come, so that the server can
// tell how old it is without believing this device's clock.
const RETRY = 700;     // [ms] before the next attempt to connect
const STALLED = 400;   // [ms] without a state: the connection stalls
const FULL = 2048;     // [bytes] waiting here: a command more would only come late
const PING = 1000;     // [ms] between two measurements of the round trip

export class Link {
  // on: functions by kind of message, and `connection(open)`
  constructor(on) {
    this.on = on;
    this.time = null;       // [ms] newest server time
    this.heard = -Infinity; // [ms] when it came, by performance.now()
    this.page = null;
    this.roundTrip = null;  // [ms]
    this.connect();
    setInterval(() => this.send({kind: "ping", time: performance.now()}), PING);
  }

  get stalled() {
    return performance.now() - this.heard > STALLED;
  }

  connect() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(`${scheme}//${location.host}/socket`);
    let opened = false;
    this.socket.onopen = () => {
      opened = true;
    };
    this.socket.onmessage = (event) => this.receive(JSON.parse(event.data));
    this.socket.onclose = () => {
      this.time = this.page = this.roundTrip = null;
      this.heard = -Infinity;
      this.on.connection(false);
      setTimeout(() => (opened ? this.connect() : this.lookForToken()), RETRY);
    };
  }

  // A browser does not say why a socket was refused; the page itself does.
  async lookForToken() {
    try {
      const response = await fetch("./", {cache: "no-store"});
      if (response.status === 401) {
        location.reload();
        return;
      }
    } catch {
      // no server: go on trying
    }
    this.connect();
  }

  receive(message) {
    if (message.kind === "hello") {
      this.page = message.page;
      this.on.connection(true);
    } else if (message.kind === "state") {
      this.time = Math.max(this.time ?? 0, message.time);
      this.heard = performance.now();
    } else if (message.kind === "pong") {
      this.roundTrip = performance.now() - message.time;
    }
    this.on[message.kind]?.(message);
  }

  send(message) {
    if (this.socket.readyState !== WebSocket.OPEN || this.page === null || this.socket.bufferedAmount > FULL) {
      return;
    }
    this.socket.send(JSON.stringify(message));
  }

  drive(x, y, turn) {
    if (this.time !== null) {
      const round = (value) => Math.round(value * 1e4) / 1e4;
      this.send({kind: "drive", time: this.time, x: round(x), y: round(y), turn: round(turn)});
    }
  }
}
