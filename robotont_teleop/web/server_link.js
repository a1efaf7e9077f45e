// The connection to the server. Every command carries the newest server time that has come, so that the server can
// tell how old it is without believing this device's clock.
const RETRY = 700;     // [ms] before the next attempt to connect
const STALLED = 400;   // [ms] without a state: the connection stalls
const LOST = 6000;     // [ms] without a state: a new connection comes sooner than the old one revives
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
    this.stopWanted = false; // STOP has been pressed, and no state has confirmed it yet
    this.stopAt = 0;         // [ms] when
    this.connect();
    setInterval(() => {
      this.send({kind: "ping", time: performance.now()});
      if (this.page !== null && performance.now() - this.heard > LOST) {
        this.giveUp();
      }
    }, PING);
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
      this.disconnected();
      setTimeout(() => (opened ? this.connect() : this.lookForToken()), RETRY);
    };
  }

  disconnected() {
    this.time = this.page = this.roundTrip = null;
    this.heard = -Infinity;
    this.on.connection(false);
  }

  // Leave a dead connection behind: its own end may take minutes.
  giveUp() {
    this.socket.onmessage = this.socket.onclose = null;
    this.socket.close();
    this.disconnected();
    this.connect();
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
      this.heard = performance.now();
      this.on.connection(true);
      if (this.stopWanted) {
        this.stop();
      }
    } else if (message.kind === "state") {
      this.time = Math.max(this.time ?? 0, message.time);
      this.heard = performance.now();
      this.stopWanted &&= !message.stopped;
    } else if (message.kind === "pong") {
      this.roundTrip = performance.now() - message.time;
    }
    this.on[message.kind]?.(message);
  }

  // The emergency stop goes out whatever waits before it, and again on the next connection if this one loses it.
  stop() {
    this.stopAt = this.stopWanted ? this.stopAt : performance.now();
    this.stopWanted = true;
    if (this.socket.readyState === WebSocket.OPEN && this.page !== null) {
      this.socket.send(JSON.stringify({kind: "stop"}));
    }
  }

  // What must not be carried out late: with the newest server time that this page has seen.
  order(message) {
    if (this.time !== null) {
      this.send({...message, time: this.time});
    }
  }

  send(message) {
    if (this.socket.readyState !== WebSocket.OPEN || this.page === null || this.socket.bufferedAmount > FULL) {
      return;
    }
    this.socket.send(JSON.stringify(message));
  }

  drive(x, y, turn) {
    const round = (value) => Math.round(value * 1e4) / 1e4;
    this.order({kind: "drive", x: round(x), y: round(y), turn: round(turn)});
  }
}
