// A place by a long press: from then on it follows the finger; a tap takes it back.
const HOLD = 500; // [ms]
const STILL = 12; // [px] that a finger moves while it is held still

// chosen(event): the place is there, null: it is nowhere; possible(): whether a place can be chosen now
export function choosePlace(element, possible, chosen) {
  let timer = null; // of a press that is not long yet
  let from = null;  // where that one, or the chosen place, began
  let chooses = false;
  element.addEventListener("pointerdown", (event) => {
    chosen(null);
    from = event;
    timer = possible() && setTimeout(() => {
      chooses = true;
      chosen(event);
    }, HOLD);
  });
  element.addEventListener("pointermove", (event) => {
    if (chooses) {
      chosen(event);
    } else if (from && Math.hypot(event.clientX - from.clientX, event.clientY - from.clientY) > STILL) {
      clearTimeout(timer);
    }
  });
  for (const end of ["pointerup", "pointercancel", "pointerleave"]) {
    element.addEventListener(end, () => {
      clearTimeout(timer);
      chooses = false;
    });
  }
}
