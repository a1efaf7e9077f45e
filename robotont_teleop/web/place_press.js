// A place by a long press: from then on it follows the finger; a tap takes it back.
const HOLD = 500; // [ms]

// chosen(event): the place is there, null: it is nowhere; possible(): whether a place can be chosen now
export function choosePlace(element, possible, chosen) {
  let timer = null; // of a press that is not long yet
  let chooses = false;
  element.addEventListener("pointerdown", (event) => {
    chosen(null);
    timer = possible() && setTimeout(() => {
      chooses = true;
      chosen(event);
    }, HOLD);
  });
  element.addEventListener("pointermove", (event) => chooses && chosen(event));
  for (const end of ["pointerup", "pointercancel", "pointerleave"]) {
    element.addEventListener(end, () => {
      clearTimeout(timer);
      chooses = false;
    });
  }
}
