// What the hands ask for: two sticks on the screen, keys, a gamepad. A position is {ahead, left, turn}, each from -1 to 1.
import {Pad} from "./pad.js";
import {$} from "./page.js";
import {Stick} from "./stick.js";

const KEYS = {
  KeyW: ["ahead", 1], KeyS: ["ahead", -1], KeyA: ["left", 1], KeyD: ["left", -1], KeyQ: ["turn", 1], KeyE: ["turn", -1],
  ArrowUp: ["ahead", 1], ArrowDown: ["ahead", -1], ArrowLeft: ["turn", 1], ArrowRight: ["turn", -1],
};
const SPEEDS = ["Digit1", "Digit2", "Digit3"];

const clamp = (value) => Math.min(1, Math.max(-1, value));

export class DrivingInputs {
  // changed(): called when the position may have changed; stop(): the emergency stop's keys and button; step(number,
  // whole): a speed more or less, or that one
  constructor(changed, stop, step) {
    this.changed = changed;
    this.live = false; // whether they move the robot; else they are still, whatever is held
    this.move = new Stick($("move"), {wide: false, changed});
    this.turn = new Stick($("turn"), {wide: true, changed});
    this.keys = new Set();
    this.gamepad = new Pad();
    this.pad = {ahead: 0, left: 0, turn: 0};
    this.padGone = false; // whether the gamepad may be out of reach
    this.listenToKeys(stop, step);
    this.listenToWhatSwallowsKeys();
    this.listenToFocus();
    this.listenToGamepads(stop, step);
    for (const [target, event] of [[window, "blur"], [window, "pagehide"], [document, "visibilitychange"],
      [document, "freeze"]]) {
      target.addEventListener(event, () => (event !== "visibilitychange" || document.hidden) && this.letGo());
    }
  }

  get position() {
    const held = {ahead: 0, left: 0, turn: 0};
    for (const key of this.keys) {
      held[KEYS[key][0]] += KEYS[key][1];
    }
    let ahead = this.move.up + held.ahead + this.pad.ahead;
    let left = -this.move.right + held.left + this.pad.left;
    const length = Math.max(1, Math.hypot(ahead, left)); // a diagonal is no faster
    ahead /= length;
    left /= length;
    return {ahead, left, turn: clamp(-this.turn.right + held.turn + this.pad.turn)};
  }

  get still() {
    const {ahead, left, turn} = this.position;
    return ahead === 0 && left === 0 && turn === 0;
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
    this.pad = {ahead: 0, left: 0, turn: 0};
    this.gamepad.letGo();
    this.move.letGo();
    this.turn.letGo();
    this.changed();
  }

  listenToKeys(stop, step) {
    window.addEventListener("keydown", (event) => {
      const on = (kinds) => Boolean(event.target.closest?.(kinds));
      const taken = on("select"); // they choose in what has the focus
      if (event.code === "Escape" || (event.code === "Space" && !on("button"))) {
        event.preventDefault();
        this.letGo();
        stop();
      } else if (event.ctrlKey || event.metaKey || event.altKey) {
        this.letGo();
      } else if (SPEEDS.includes(event.code) && !taken) {
        step(SPEEDS.indexOf(event.code), true);
      } else if (KEYS[event.code] && !taken) {
        event.preventDefault();
        if (this.live && !event.repeat && !this.keys.has(event.code)) {
          this.keys.add(event.code);
          this.changed();
        }
      }
    });
    window.addEventListener("keyup", (event) => {
      if (event.code.startsWith("Meta")) {
        this.letGo();
      } else if (this.keys.delete(event.code)) {
        this.changed();
      }
    });
  }

  // Where the end of a key may never be heard of, it is let go of: menus, lists, and on macOS Cmd swallow it.
  listenToWhatSwallowsKeys() {
    window.addEventListener("contextmenu", (event) => event.defaultPrevented || this.letGo());
    window.addEventListener("focusin", (event) => event.target.closest?.("select") && this.letGo());
  }

  // What a finger or the mouse has used does not keep the keys from the robot; what Tab has reached does.
  listenToFocus() {
    const leave = (kinds) => setTimeout(() => document.activeElement?.matches(kinds) && document.activeElement.blur());
    window.addEventListener("pointerup", (event) => leave(
      event.target.closest?.("select") ? "button" : "button, select")); // a list may just have opened
    window.addEventListener("click", (event) => event.detail > 0 && leave("button")); // a finger's focus is late
    let keyOnList = false;
    window.addEventListener("pointerdown", () => (keyOnList = false));
    window.addEventListener("keydown", (event) => (keyOnList ||= !event.repeat && event.target.matches?.("select")));
    window.addEventListener("change", () => keyOnList || leave("select"));
  }

  listenToGamepads(stop, step) {
    let frame = null; // of the next look
    const poll = () => {
      const found = navigator.getGamepads?.().find((one) => one?.connected && one.mapping === "standard");
      const pad = this.gamepad.look(found, performance.now());
      if (pad.stop) {
        stop();
      }
      if (pad.step) {
        step(pad.step);
      }
      this.padGone = pad.gone;
      this.pad = this.live ? pad : {ahead: 0, left: 0, turn: 0};
      this.changed();
      frame = found && !document.hidden ? requestAnimationFrame(poll) : null;
    };
    for (const event of ["gamepadconnected", "gamepaddisconnected", "visibilitychange"]) {
      window.addEventListener(event, () => frame === null && poll());
    }
  }
}
