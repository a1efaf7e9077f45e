// Elements of the page.
export const $ = (id) => document.getElementById(id);

// Writes only what has changed: nothing is laid out anew without need, and readers of the screen repeat nothing.
export function write(element, words) {
  if (element.textContent !== words) {
    element.textContent = words;
  }
}

// Likewise an attribute: a browser draws anew what is set, also where it is the same
export function set(element, name, value) {
  if (element.getAttribute(name) !== String(value)) {
    element.setAttribute(name, value);
  }
}

// Two decimals, and no zero with a sign
export function number(value) {
  return (Math.round(value * 100) / 100 + 0).toFixed(2);
}

// How full a battery is, as words; or its voltage, or nothing
export function chargeOf(battery) {
  const {charge, voltage} = battery ?? {};
  return charge != null ? `${Math.round(100 * charge)} %` : voltage != null ? `${voltage.toFixed(1)} V` : "";
}
