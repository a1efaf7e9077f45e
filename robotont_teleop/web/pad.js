// A gamepad of the browser's Gamepad API (standard mapping), as numbers. Knows no browser; times [ms] are the caller's.
import {asked} from "./stick_curve.js";

const DEAD_ZONE = 0.12;     // of a stick
const SHOULDERS = [4, 5];   // either must be held: the dead-man button
const EAST = 1;             // emergency stop
// A pad whose radio is out of reach stays connected and keeps its newest state for ever, as a stick that is held still
// does; no browser tells them apart. So what does not change for this long counts as gone.
export const STILL = 1500;  // [ms]

export class Pad {
  newest = "";         // state, as a text
  changedAt = -Infinity;
  pressed = [];        // buttons of the look before
  centred = false;     // whether the sticks have been in the middle since the dead-man button went down

  // pad: of navigator.getGamepads(). {ahead, left, turn} from -1 to 1, stop: pressed just now,
  // gone: whether it may be out of reach
  look(pad, now) {
    const down = pad.buttons.map((button) => button.pressed);
    const axes = [0, 1, 2].map((axis) => Math.sign(pad.axes[axis]) * asked(Math.abs(pad.axes[axis]), DEAD_ZONE) || 0);
    const newest = JSON.stringify([pad.axes, pad.buttons.map((button) => button.value)]);
    if (newest !== this.newest) {
      this.newest = newest;
      this.changedAt = now;
    }
    const just = (button) => Boolean(down[button] && !this.pressed[button]);
    const held = SHOULDERS.some((button) => down[button]);
    const stop = just(EAST);
    this.pressed = down;
    this.centred = held && (this.centred || axes.every((value) => value === 0));
    const gone = held && this.centred && axes.some(Boolean) && now - this.changedAt >= STILL;
    const [x, y, turn] = this.centred && !gone ? axes : [0, 0, 0];
    return {ahead: 0 - y, left: 0 - x, turn: 0 - turn, stop, gone};
  }
}

// All gamepads of a browser: each can stop, and the first one that asks for motion drives.
export class Pads {
  pads = new Map(); // by the browser's index

  // found: gamepads of navigator.getGamepads(); as `look` of one
  look(found, now) {
    this.pads = new Map(found.map(({index}) => [index, this.pads.get(index) ?? new Pad()]));
    const looks = found.map((pad) => this.pads.get(pad.index).look(pad, now));
    const {ahead = 0, left = 0, turn = 0} = looks.find((one) => one.ahead || one.left || one.turn) ?? {};
    return {ahead, left, turn, stop: looks.some((one) => one.stop), gone: looks.some((one) => one.gone)};
  }

  // From now on the sticks move nothing until they have been in the middle.
  letGo() {
    this.pads.forEach((one) => (one.centred = false));
  }
}
