// A press that is long: for what a touch in passing shall not do.
const HOLD = 1000; // [ms]
const ENDS = ["pointerup", "pointerleave", "pointercancel", "keyup", "blur"];

// After `time` [ms] of a press, by a pointer or a key, for which begin(event) was true: long(event), once. end(): it is
// over, or long; the former also after the latter.
export function onLongPress(element, time, begin, long, end) {
  let timer = null;
  const over = () => {
    clearTimeout(timer);
    timer = null;
    end();
  };
  const press = (event) => (timer ??= begin(event) ? setTimeout(() => {
    over();
    long(event);
  }, time) : null);
  ["pointerdown", "keydown"].forEach((event) => element.addEventListener(event, press));
  ENDS.forEach((event) => element.addEventListener(event, over));
  window.addEventListener("blur", over);
  document.addEventListener("visibilitychange", over);
}

// A button that acts only after a press of a whole second: the ring fills while it lasts. act(then): with what seen()
// was when the press began, for what has come since the person could not mean.
export function actWhenHeld(button, act, seen) {
  let then = null;
  onLongPress(button, HOLD, (event) => {
    const means = event.code ? ["Enter", "Space"].includes(event.code) && !event.repeat : !event.preventDefault();
    then = seen();
    button.classList.toggle("filling", means && !button.disabled);
    return means && !button.disabled;
  }, () => act(then), () => button.classList.remove("filling"));
  button.addEventListener("contextmenu", (event) => event.preventDefault());
}
