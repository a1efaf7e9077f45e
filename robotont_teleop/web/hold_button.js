// A button that acts only after a press of a whole second: the ring fills while it lasts.
const HOLD = 1000; // [ms]

export function actWhenHeld(button, act) {
  let timer = null;
  const begin = () => {
    if (timer === null && !button.disabled) {
      button.classList.add("filling");
      timer = setTimeout(() => {
        end();
        act();
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
  button.addEventListener("keydown", (event) => ["Enter", "Space"].includes(event.code) && begin());
  for (const event of ["pointerup", "pointerleave", "pointercancel", "keyup", "blur"]) {
    button.addEventListener(event, end);
  }
  window.addEventListener("blur", end);
  document.addEventListener("visibilitychange", end);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
}
