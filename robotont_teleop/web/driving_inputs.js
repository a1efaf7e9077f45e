// What the hands ask for: two sticks on the screen, keys, a gamepad. A position is {ahead, left, turn}, each from -1 to 1.
import {Pads} from "./pad.js";
import {$} from "./page.js";
import {Stick} from "./stick.js";

const KEYS = {
  KeyW: ["ahead", 1], KeyS: ["ahead", -1], KeyA: ["left", 1], KeyD: ["left", -1], KeyQ: ["turn", 1], KeyE: ["turn", -1],
  ArrowUp: ["ahead", 1], ArrowDown: ["ahead", -1], ArrowLeft: ["turn", 1], ArrowRight: ["turn", -1],
};
const STOPS = ["Space", "Escape", " "]; // the last is all that some remote desktops tell of the first
const SPEEDS = ["Digit1", "Digit2", "Digit3"];
const LOOK = 16;   // [ms] between two looks at the gamepads: by a clock, for a covered window may draw no frames
const STILL = {ahead: 0, left: 0, turn: 0};

const clamp = (value) => Math.min(1, Math.max(-1, value));

export class DrivingInputs {
  live = false;    // whether they move the robot; else they are still, whatever is held
  keys = new Set();
  gamepads = new Pads();
  pad = STILL;
  padGone = false; // whether the gamepad may be out of reach

  // changed(): called when the position may have changed; stop(): the emergency stop's keys and button;
  // setSpeed(number)
  constructor(changed, stop, setSpeed) {
    this.changed = changed;
    this.move = new Stick($("move"), {wide: false, changed});
    this.turn = new Stick($("turn"), {wide: true, changed});
    this.listenToKeys(stop, setSpeed);
    this.listenToGamepads(stop);
    // where the end of a key may never be heard of, it is let go of; menus swallow it, too
    for (const [target, event] of [[window, "blur"], [window, "pagehide"], [window, "contextmenu"],
      [document, "visibilitychange"], [document, "freeze"]]) {
      target.addEventListener(event, ({defaultPrevented}) => defaultPrevented || this.letGo());
    }
  }

  get position() {
    const held = {...STILL};
    for (const key of this.keys) {
      held[KEYS[key][0]] += KEYS[key][1];
    }
    const ahead = this.move.up + held.ahead + this.pad.ahead;
    const left = -this.move.right + held.left + this.pad.left;
    const length = Math.max(1, Math.hypot(ahead, left)); // a diagonal is no faster
    return {ahead: ahead / length, left: left / length, turn: clamp(-this.turn.right + held.turn + this.pad.turn)};
  }

  get still() {
    return Object.values(this.position).every((part) => part === 0);
  }

  // Whether a finger is on a stick that moves nothing until it has been lifted
  get dropped() {
    return this.move.dropped !== null || this.turn.dropped !== null;
  }

  setLive(live) {
    if (this.live !== live) {
      this.live = live;
      this.letGo();
    }
  }

  // Everything is let go of, whatever is still held.
  letGo() {
    this.keys.clear();
    this.pad = STILL;
    this.gamepads.letGo();
    this.move.letGo();
    this.turn.letGo();
    this.changed();
  }

  listenToKeys(stop, setSpeed) {
    window.addEventListener("keydown", (event) => {
      if (STOPS.includes(event.code) || STOPS.includes(event.key)) {
        event.preventDefault();
        document.activeElement.blur(); // else a button that has the focus is pressed by the space bar's end
        stop();
      } else if (event.ctrlKey || event.metaKey || event.altKey) {
        this.letGo();
      } else if (SPEEDS.includes(event.code)) {
        setSpeed(SPEEDS.indexOf(event.code));
      } else if (KEYS[event.code]) {
        event.preventDefault();
        if (this.live && !event.repeat) {
          this.keys.add(event.code);
          this.changed();
        }
      }
    });
    window.addEventListener("keyup", ({code}) => {
      if (code.startsWith("Meta")) { // macOS tells no end of a key that was held with Cmd
        this.letGo();
      } else if (this.keys.delete(code)) {
        this.changed();
      }
    });
  }

  listenToGamepads(stop) {
    let next = null; // look
    const poll = () => {
      const found = [...navigator.getGamepads?.() ?? []].filter((one) => one?.connected && one.mapping === "standard");
      const pad = this.gamepads.look(found, performance.now());
      if (pad.stop) {
        stop();
      }
      this.padGone = pad.gone;
      this.pad = this.live ? pad : STILL;
      this.changed();
      next = found.length && !document.hidden ? setTimeout(poll, LOOK) : null;
    };
    for (const event of ["gamepadconnected", "gamepaddisconnected", "visibilitychange"]) {
      window.addEventListener(event, () => next === null && poll());
    }
  }
}
