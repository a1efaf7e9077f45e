// All robots on one map.
import {World, at} from "./floor_svg.js";

const MARGIN = 1, LEAST = 4;  // [m] around the robots; the smallest ground
const CROWD = 12;             // robots whose names would hide each other
const svg = document.getElementById("map");
export const world = new World(svg, [[1, 0], [0, -1]]);

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

// How many letters all names begin with: of robot1 ... robot40 the map shows the numbers.
function sharedLetters(names) {
  let count = 0;
  while (/[^0-9]/.test(names[0][count] ?? "0") && names.every((name) => name[count] === names[0][count])) {
    count++;
  }
  return names.some((name) => name.length === count) ? 0 : count;
}

export function draw(view, chosen) {
  const robots = view.robots.filter((robot) => robot.frame === "map" && robot.pose);
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
  const crowd = robots.length > CROWD, alike = crowd ? sharedLetters(robots.map((robot) => robot.name)) : 0;
  const radius = Math.max(8 / scale, 0.15);
  svg.classList.toggle("crowd", crowd);
  svg.querySelector(".robots").replaceChildren(...robots.map((robot) => {
    const [x, y, yaw] = robot.pose, place = svg.querySelector("defs .place").cloneNode(true), [body, name] = place.children;
    place.setAttribute("transform", at([x, y]));
    place.classList.add(robot.present ? "here" : "gone", robot.stopped ? "stopped" : robot.id === chosen ? "chosen" : "free");
    body.setAttribute("transform", `${at([0, 0, yaw])} scale(${radius})`);
    name.setAttribute("y", -radius * scale - 5);
    name.textContent = robot.name.slice(alike);
    return place;
  }));
}
