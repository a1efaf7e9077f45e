// From a thumb's way to a stick's position: a middle that is still, then softly, and straight ahead where it was meant.
export const REACH = 80;    // [px] from the place where the thumb has landed to full speed
const MIDDLE = 0.08;        // part of it that counts as the middle
const SOFT = 0.35;          // slope behind the middle; the rim asks for 1

// What a part of the whole way asks for, from 0 to 1, behind a middle: of a thumb's way, and of a gamepad's stick
export function asked(part, middle) {
  const pushed = Math.min(1, Math.max(0, (part - middle) / (1 - middle)));
  return SOFT * pushed + (1 - SOFT) * pushed ** 3;
}

// [right, up], each from -1 to 1 within the circle, of a way (x to the right, y down) [px]
export function position(x, y) {
  const length = Math.hypot(x, y) / REACH;
  const part = asked(length, MIDDLE) / (length * REACH) || 0; // 0 / 0 where it has landed
  return [x * part, 0 - y * part];
}
