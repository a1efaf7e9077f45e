// A button that acts only after a press of a whole second, and once: the ring fills while it lasts. act(then): with what
// seen() was when the press began, for what has come since the person could not mean.
const HOLD = 1000; // [ms]

export function actWhenHeld(button, act, seen) {
  let timer = null;
  const begin = () => {
    if (timer === null && !button.disabled) {
      const then = seen();
      button.classList.add("filling");
      timer = setTimeout(() => {
        end();
        act(then);
      }, HOLD);
    }
  };
  const end = () => {
    clearTimeout(timer);
    timer = null;
    button.classList.remove("filling");
  };
  button.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    begin();
  });
  button.addEventListener("keydown", (event) => ["Enter", "Space"].includes(event.code) && !event.repeat && begin());
  for (const event of ["pointerup", "pointerleave", "pointercancel", "keyup", "blur"]) {
    button.addEventListener(event, end);
  }
  window.addEventListener("blur", end);
  document.addEventListener("visibilitychange", end);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
}
