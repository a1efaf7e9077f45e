// All robots on one map, each a disc with what tells its name from the others.
import {World, at} from "./floor_svg.js";

const MARGIN = 1, LEAST = 4;      // [m] around the robots; the smallest ground
const RADIUS = 13, BODY = 0.15;   // [px, m] the least of a disc
const LETTERS = 3;                // in a disc
const svg = document.getElementById("map");
export const world = new World(svg, [1, 0, 0, -1]);

function bounds({robots, ground}) {
  const xs = [], ys = [];
  for (const {pose} of robots) {
    xs.push(pose[0] - MARGIN, pose[0] + MARGIN);
    ys.push(pose[1] - MARGIN, pose[1] + MARGIN);
  }
  if (ground) {
    xs.push(ground.x, ground.x + ground.width);
    ys.push(ground.y, ground.y + ground.height);
  }
  return [Math.floor(Math.min(...xs)), Math.ceil(Math.max(...xs)), Math.floor(Math.min(...ys)), Math.ceil(Math.max(...ys))];
}

// By name what of it stands in a disc: of robot1 ... robot40 the numbers.
export function shortNames(names) {
  let alike = 0;
  while (names.length && /[^0-9]/.test(names[0][alike] ?? "0") && names.every((name) => name[alike] === names[0][alike])) {
    alike++;
  }
  alike = names.some((name) => name.length === alike) ? 0 : alike;
  return new Map(names.map((name) => [name, name.slice(alike, alike + LETTERS)]));
}

// shorts: of shortNames; chosen(robot): whether it waits for a place to go to.
export function draw(view, shorts, chosen) {
  const robots = view.robots.filter((robot) => robot.frame === "map" && robot.pose).reverse();  // the worst on top
  const {width, height} = svg.getBoundingClientRect();
  if (!width || !(robots.length || view.ground)) {
    return;
  }
  const [x0, x1, y0, y1] = bounds({robots, ground: view.ground});
  const scale = Math.min(width / Math.max(LEAST, x1 - x0), height / Math.max(LEAST, y1 - y0));
  world.show((x0 + x1) / 2, (y0 + y1) / 2, scale);
  if (view.ground) {
    const {x, y, width: long, height: high} = view.ground;  // another map after a restart of the fleet is another address
    world.showMap(`map.png?${[x, y, long, high]}`, {...view.ground, origin: [x, y]});
  }
  const radius = Math.max(RADIUS / scale, BODY);
  svg.querySelector(".robots").replaceChildren(...robots.map((robot) => {
    const [x, y, yaw] = robot.pose, place = svg.querySelector("defs .place").cloneNode(true);
    const [title, body, name] = place.children;
    place.setAttribute("transform", at([x, y]));
    place.classList.add(robot.present ? "here" : "gone", robot.stopped ? "stopped" : chosen(robot) ? "chosen" : "free");
    title.textContent = robot.name;
    body.setAttribute("transform", `${at([0, 0, yaw])} scale(${radius})`);
    name.textContent = shorts.get(robot.name);
    return place;
  }));
}
