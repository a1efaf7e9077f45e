// A stick on the screen that follows the finger which has touched it.
const MIDDLE = 0.06; // part of its reach that counts as its middle

// Raw updates come as soon as the finger moves, pointermove only with the next frame. Not every browser has them, and
// none outside secure contexts (https, this computer).
const MOVE = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";

export class Stick {
  // wide: moves to the sides only; changed(): called when its position may have changed
  constructor(element, {wide, changed}) {
    this.element = element;
    this.knob = element.querySelector(".knob");
    this.wide = wide;
    this.changed = changed;
    this.pointer = null;
    this.right = this.up = 0;   // position, each from -1 to 1
    this.middle = {x: 0, y: 0}; // [px] on the screen
    this.reach = 0;             // [px] of the knob
    window.addEventListener("resize", () => this.measure());
    element.addEventListener("pointerdown", (event) => this.grab(event));
    element.addEventListener(MOVE, (event) => event.pointerId === this.pointer && this.follow(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      element.addEventListener(end, (event) => event.pointerId === this.pointer && this.losePointer());
    }
    element.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  // Once per touch, not per movement: the browser may have to lay out the page for it.
  measure() {
    const box = this.element.getBoundingClientRect();
    this.middle = {x: box.left + box.width / 2, y: box.top + box.height / 2};
    this.reach = (box.width - this.knob.offsetWidth) / 2;
  }

  grab(event) {
    if (this.pointer !== null || event.button !== 0) {
      return;
    }
    event.preventDefault();
    this.pointer = event.pointerId;
    this.element.classList.add("held");
    try {
      this.element.setPointerCapture(event.pointerId);
    } catch {
      // the pointer is gone already: its end comes next
    }
    this.measure();
    this.follow(event);
  }

  follow({clientX, clientY}) {
    const right = (clientX - this.middle.x) / this.reach;
    const up = this.wide ? 0 : (this.middle.y - clientY) / this.reach;
    const distance = Math.hypot(right, up);
    const part = distance < MIDDLE ? 0 : 1 / Math.max(1, distance);
    this.setPosition(right * part, up * part);
    this.changed();
  }

  losePointer() {
    this.letGo();
    this.changed();
  }

  letGo() {
    this.pointer = null;
    this.element.classList.remove("held");
    this.setPosition(0, 0);
  }

  setPosition(right, up) {
    this.right = right;
    this.up = up;
    this.knob.style.transform = `translate(${right * this.reach}px, ${-up * this.reach}px)`;
  }
}
