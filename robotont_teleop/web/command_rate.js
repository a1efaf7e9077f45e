// When commands go out: at once when the hands move, again while they hold still, and once more when they have let go.
const REPEAT = 40; // [ms] between two commands while the hands hold still
const SOONEST = 8; // [ms] between two commands while they move

export class CommandRate {
  // still(): whether the hands ask for no motion; send(): sends the command of now
  constructor(still, send) {
    this.still = still;
    this.send = send;
    this.moving = false;
    this.sentAt = -Infinity; // [ms] by performance.now()
    this.later = null;       // timer of a command for which it was too soon
    setInterval(() => this.moving && this.changed(), REPEAT);
  }

  // To be called when what the hands ask for may have changed.
  changed() {
    const still = this.still();
    const wait = still ? 0 : this.sentAt + SOONEST - performance.now();
    clearTimeout(this.later);
    if (wait > 0) {
      this.later = setTimeout(() => this.changed(), wait);
    } else if (!still || this.moving) {
      this.moving = !still;
      this.sentAt = performance.now();
      this.send();
    }
  }
}
