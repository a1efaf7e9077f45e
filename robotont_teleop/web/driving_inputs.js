// What the hands ask for: two sticks on the screen, keys, a gamepad. A position is {ahead, left, turn}, each from -1 to 1.
import {$} from "./page.js";
import {Stick} from "./stick.js";

const KEYS = {
  KeyW: ["ahead", 1], KeyS: ["ahead", -1], KeyA: ["left", 1], KeyD: ["left", -1], KeyQ: ["turn", 1], KeyE: ["turn", -1],
  ArrowUp: ["ahead", 1], ArrowDown: ["ahead", -1], ArrowLeft: ["turn", 1], ArrowRight: ["turn", -1],
};
const DEAD_ZONE = 0.12;           // of a gamepad's stick
const SHOULDERS = [4, 5];         // either must be held: the dead-man button (standard mapping of the Gamepad API)
const EAST = 1;                   // emergency stop

const clamp = (value) => Math.min(1, Math.max(-1, value));

export class DrivingInputs {
  // changed(): called when the position may have changed; stop(): the emergency stop's keys and button
  constructor(changed, stop) {
    this.changed = changed;
    this.move = new Stick($("move"), {wide: false, changed});
    this.turn = new Stick($("turn"), {wide: true, changed});
    this.keys = new Set();
    this.pad = {ahead: 0, left: 0, turn: 0};
    this.padStop = false;
    this.padCentred = false;
    this.listenToKeys(stop);
    this.listenToWhatSwallowsKeys();
    this.listenToFocus();
    this.listenToGamepads(stop);
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

  // Everything is let go of, whatever is still held.
  letGo() {
    this.keys.clear();
    this.pad = {ahead: 0, left: 0, turn: 0};
    this.padCentred = false;
    this.move.letGo();
    this.turn.letGo();
    this.changed();
  }

  listenToKeys(stop) {
    window.addEventListener("keydown", (event) => {
      const on = (kinds) => Boolean(event.target.closest?.(kinds));
      const taken = on("select") || (on("input") && event.code.startsWith("Arrow")); // they choose in what has the focus
      if (event.code === "Escape" || (event.code === "Space" && !on("button"))) {
        event.preventDefault();
        this.letGo();
        stop();
      } else if (event.ctrlKey || event.metaKey || event.altKey) {
        this.letGo();
      } else if (KEYS[event.code] && !taken) {
        event.preventDefault();
        if (!event.repeat && !this.keys.has(event.code)) {
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
      event.target.closest?.("select") ? "button, input" : "button, input, select")); // a list may just have opened
    window.addEventListener("click", (event) => event.detail > 0 && leave("button, input")); // a finger's focus is late
    let keyOnList = false;
    window.addEventListener("pointerdown", () => (keyOnList = false));
    window.addEventListener("keydown", (event) => (keyOnList ||= !event.repeat && event.target.matches?.("select")));
    window.addEventListener("change", () => keyOnList || leave("select"));
  }

  listenToGamepads(stop) {
    let frame = null; // of the next look
    const poll = () => {
      const pad = navigator.getGamepads?.().find((found) => found?.connected && found.mapping === "standard");
      this.takeGamepad(pad, stop);
      frame = pad && !document.hidden ? requestAnimationFrame(poll) : null;
    };
    for (const event of ["gamepadconnected", "gamepaddisconnected", "visibilitychange"]) {
      window.addEventListener(event, () => frame === null && poll());
    }
  }

  takeGamepad(pad, stop) {
    const pressed = Boolean(pad?.buttons[EAST]?.pressed);
    if (pressed && !this.padStop) {
      stop();
    }
    this.padStop = pressed;
    const held = pad && SHOULDERS.some((button) => pad.buttons[button]?.pressed);
    const [x, y, turn] = pad ? [0, 1, 2].map((axis) => outsideDeadZone(pad.axes[axis] || 0)) : [0, 0, 0];
    const centred = x === 0 && y === 0 && turn === 0;
    this.padCentred = Boolean(held) && (this.padCentred || centred); // deflected before the button: moves nothing
    this.pad = this.padCentred ? {ahead: 0 - y, left: 0 - x, turn: 0 - turn} : {ahead: 0, left: 0, turn: 0};
    this.changed();
  }
}

function outsideDeadZone(value) {
  const size = Math.abs(value);
  return size <= DEAD_ZONE ? 0 : Math.sign(value) * Math.min(1, (size - DEAD_ZONE) / (1 - DEAD_ZONE));
}
