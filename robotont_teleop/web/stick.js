// A stick under a thumb: its middle is where the thumb has landed in its field.
import {REACH, position} from "./stick_curve.js";

// Raw updates come as soon as the finger moves, pointermove only with the next frame. Not every browser has them, and
// none outside secure contexts (https, this computer).
const MOVE = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";

export class Stick {
  pointer = null;   // the finger that moves it
  dropped = null;   // one that moves it no more until it is lifted
  right = 0;        // position, from -1 to 1
  up = 0;
  landed = [0, 0];  // [px] on the screen

  // field: its element; wide: moves to the sides only; changed(): called when its position may have changed
  constructor(field, {wide, changed}) {
    this.field = field;
    this.ring = field.querySelector(".ring");
    this.knob = field.querySelector(".knob");
    this.wide = wide;
    this.changed = changed;
    field.addEventListener("pointerdown", (event) => this.grab(event));
    field.addEventListener(MOVE, (event) => event.pointerId === this.pointer && this.follow(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      field.addEventListener(end, (event) => this.lose(event.pointerId));
    }
    field.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  grab(event) {
    if (this.pointer !== null || event.button !== 0) {
      return;
    }
    event.preventDefault();
    if (this.field.closest("[data-live='false']")) {
      this.dropped = event.pointerId;
    } else {
      this.pointer = event.pointerId;
      this.field.classList.add("held");
      this.landed = [event.clientX, event.clientY];
      const box = this.field.getBoundingClientRect(); // once per touch: the browser may have to lay out the page for it
      this.ring.style.translate =
        `${event.clientX - box.left - box.width / 2}px ${event.clientY - box.top - box.height / 2}px`;
    }
    try {
      this.field.setPointerCapture(event.pointerId);
    } catch {
      // the pointer is gone already: its end comes next
    }
  }

  follow({clientX, clientY}) {
    const way = [clientX - this.landed[0], this.wide ? 0 : clientY - this.landed[1]];
    const beyond = Math.max(1, Math.hypot(...way) / REACH);
    this.knob.style.translate = way.map((part) => `${part / beyond}px`).join(" ");
    [this.right, this.up] = position(...way);
    this.changed();
  }

  lose(pointer) {
    if (pointer === this.pointer) {
      this.letGo();
      this.changed();
    }
    if (pointer === this.dropped) {
      this.dropped = null;
    }
  }

  letGo() {
    this.dropped = this.pointer ?? this.dropped;
    this.pointer = null;
    this.right = this.up = 0;
    this.field.classList.remove("held");
    this.ring.style.translate = this.knob.style.translate = "";
  }
}
