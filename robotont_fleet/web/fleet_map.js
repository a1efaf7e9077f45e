// All robots on one map, each a disc with the number of its name.
import {Floor, at} from "./floor_svg.js";

const MARGIN = 1, LEAST = 4;      // [m] around the robots; the smallest ground
const RADIUS = 13, BODY = 0.15;   // [px, m] the least of a disc
const LETTERS = 3;                // in a disc, of a name without a number

export class FleetMap extends Floor {
  // view: of the server; chosen(robot): whether it waits for a place to go to
  draw({robots: all, ground}, chosen) {
    const robots = all.filter((robot) => robot.frame === "map" && robot.pose).reverse();  // the worst on top
    const {clientWidth: width, clientHeight: height} = this.box;
    if (!width || !(robots.length || ground)) {
      return;
    }
    const corners = robots.flatMap(({pose: [x, y]}) => [[x - MARGIN, y - MARGIN], [x + MARGIN, y + MARGIN]]);
    if (ground) {
      const {x, y, width: long, height: high} = ground;  // another map after a restart of the fleet has another address
      this.showMap(`map.png?${[x, y, long, high]}`, {...ground, origin: [x, y]});
      corners.push([x, y], [x + long, y + high]);
    }
    const [[x0, x1], [y0, y1]] = [0, 1].map((axis) => corners.map((corner) => corner[axis])).map(
      (found) => [Math.floor(Math.min(...found)), Math.ceil(Math.max(...found))]);
    const scale = Math.min(width / Math.max(LEAST, x1 - x0), height / Math.max(LEAST, y1 - y0));
    this.show((x0 + x1) / 2, (y0 + y1) / 2, scale);
    const radius = Math.max(RADIUS / scale, BODY);
    this.part("robots").replaceChildren(...robots.map((robot) => {
      const [x, y, yaw] = robot.pose, place = this.part("place").cloneNode(true);
      const [title, body, name] = place.children;
      place.setAttribute("transform", at([x, y]));
      place.classList.add(robot.present ? "here" : "gone", robot.stopped ? "stopped" : chosen(robot) ? "chosen" : "free");
      title.textContent = robot.name;
      body.setAttribute("transform", `${at([0, 0, yaw])} scale(${radius})`);
      name.textContent = /[0-9]{1,3}$/.exec(robot.name)?.[0] ?? robot.name.slice(0, LETTERS);
      return place;
    }));
  }
}
