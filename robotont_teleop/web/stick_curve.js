// From a thumb's way to a stick's position: a middle that is still, then softly, and straight ahead where it was meant.
export const REACH = 80;    // [px] from the place where the thumb has landed to full speed
const MIDDLE = 0.08;        // part of it that counts as the middle
const SOFT = 0.35;          // slope behind the middle; the rim asks for 1

// What a part (0 to 1) of the way behind the middle asks for: of a thumb's, and of a gamepad's stick
export const soft = (pushed) => SOFT * pushed + (1 - SOFT) * pushed ** 3;

// [right, up], each from -1 to 1 within the circle, of a way (x to the right, y down) [px]
export function position(x, y) {
  const length = Math.hypot(x, y) / REACH;
  const pushed = Math.min(1, Math.max(0, (length - MIDDLE) / (1 - MIDDLE)));
  if (pushed === 0) {
    return [0, 0];
  }
  const part = soft(pushed) / (length * REACH);
  return [x * part, 0 - y * part];
}
