// The connection to the server. Every command carries the newest server time that has come, so that the server can
// tell how old it is without believing this device's clock.
const RETRY = 700;     // [ms] before the next attempt to connect
const STALLED = 400;   // [ms] without a state: the connection stalls
const LOST = 6000;     // [ms] without a state: a new connection comes sooner than the old one revives. An attempt to make
// one gets twice as long: TCP doubles its pauses, so that behind an outage it comes up to as late as that was long
const FULL = 2048;     // [bytes] waiting here: a command more would only come late
const LOOK = 1000;     // [ms] between two looks for that

export class Link {
  time = null;        // [ms] newest server time
  heard = -Infinity;  // [ms] when it came, by performance.now()
  page = null;        // number of this one, while there is a connection
  stopWanted = null;  // STOP has been pressed, and no state has said yet that the robot stands by it: {at [ms], before}
  press = null;       // the newest that a state has told of

  // on: functions by kind of message, and `connection(open)`
  constructor(on) {
    this.on = on;
    this.connect();
    setInterval(() => this.page !== null && performance.now() - this.heard > LOST && this.giveUp(), LOOK);
  }

  get stalled() {
    return performance.now() - this.heard > STALLED;
  }

  connect() {
    const socket = this.socket = new WebSocket(`${location.origin.replace("http", "ws")}/socket`);
    setTimeout(() => socket.readyState === WebSocket.CONNECTING && socket.close(), 2 * LOST);
    this.socket.onmessage = (event) => this.receive(JSON.parse(event.data));
    this.socket.onclose = () => {
      const again = this.page === null ? () => this.lookForToken() : () => this.connect();
      this.disconnected();
      setTimeout(again, RETRY);
    };
  }

  disconnected() {
    this.time = this.page = null;
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

  // A browser does not say why a socket was refused; the page itself does. No server: go on trying.
  async lookForToken() {
    const answer = await fetch("./", {cache: "no-store", signal: AbortSignal.timeout(2 * LOST)}).catch(() => null);
    if (answer?.status === 401 && !this.stopWanted) {
      location.reload();
    } else {
      this.connect();
    }
  }

  receive(message) {
    if (message.kind === "hello") {
      this.page = message.page;
      this.time = message.time; // from now on orders go out
      this.heard = performance.now();
      this.on.connection(true);
      if (this.stopWanted) {
        this.stop();
      }
    } else if (message.kind === "state") {
      this.time = Math.max(this.time ?? 0, message.time);
      this.heard = performance.now();
      // that it stands by another's press, or by an older one of this server, says nothing of this one
      this.stopWanted = message.pressed_here && message.pressed_at !== this.stopWanted?.before ? null : this.stopWanted;
      this.press = message.pressed_at;
    }
    this.on[message.kind]?.(message);
  }

  // The emergency stop goes out whatever waits before it, and again on the next connection if this one loses it.
  stop() {
    this.stopWanted ??= {at: performance.now(), before: this.press};
    this.send({kind: "stop"}, Infinity);
  }

  // What must not be carried out late: with the newest server time that this page has seen.
  order(message) {
    if (this.time !== null) {
      this.send({...message, time: this.time});
    }
  }

  // full: [bytes] that may wait here before it
  send(message, full = FULL) {
    if (this.socket.readyState === WebSocket.OPEN && this.page !== null && this.socket.bufferedAmount <= full) {
      this.socket.send(JSON.stringify(message));
    }
  }
}
