// What the sensors see around the robot, as a ring over camera and map: what is near, the least distance, and where no
// sensor sees.
import {number, set, write} from "./page.js";

const CLOSE = 0.2, NEAR = 0.6; // [m] from the robot's rim
const spot = (turn, radius) => [-radius * Math.sin(turn), -radius * Math.cos(turn)];

// gaps: [m] in equal sectors, from ahead to the left, null where no sensor sees; ahead: where that is on the screen, to
// the left of its top [rad]
export function showNear(ring, gaps, ahead) {
  const sector = (place) => ahead + place * 2 * Math.PI / gaps.length;
  const arcs = {blind: "", near: "", close: ""};
  gaps.forEach((gap, place) => {
    const kind = gap === null ? "blind" : gap < CLOSE ? "close" : "near";
    arcs[kind] += gap > NEAR ? "" : `M${spot(sector(place - 0.42), 100)}A100 100 0 0 0 ${spot(sector(place + 0.42), 100)}`;
  });
  for (const path of ring.querySelectorAll("path")) {
    set(path, "d", arcs[path.classList]);
  }
  const least = Math.min(...gaps.filter((gap) => gap !== null));
  const [x, y] = spot(sector(gaps.indexOf(least)), 72);
  const words = ring.querySelector("text");
  write(words, least < NEAR ? `${number(least)} m` : "");
  set(words, "x", x || 0);
  set(words, "y", y || 0);
}
