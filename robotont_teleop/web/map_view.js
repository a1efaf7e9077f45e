// The robot from above: map, scan, goal, robot. The map's x points up and its y to the left (REP 103), or the
// robot's.
import {Floor, at} from "./floor_svg.js";
import {set} from "./page.js";

const SMALLEST = 6;        // [px] radius of the drawn robot
const SHOWN = [6, 12];     // [m] that are seen of the floor, about; and as the whole of it where there is no map

export class View extends Floor {
  whole = false;     // whether all of the map is shown
  headingUp = false; // whether the robot looks up, not the map
  pose = null;
  map = null;
  radius = 0.15;     // [m] of the robot

  // live: whether it is that of now
  setPose(pose, live) {
    live = Boolean(live) && pose !== null && !pose.includes(null);
    this.box.classList.toggle("live", live);
    if (live && pose.some((value, axis) => value !== this.pose?.[axis])) {
      this.pose = pose;
      this.draw();
    }
  }

  setStatus({frame, map, goal, radius, scan}) {
    this.radius = radius || this.radius;
    this.map = frame === "map" ? map : null;
    if (map) {
      this.showMap(`map.png?number=${map.number}`, map);
    }
    this.part("ground").toggleAttribute("hidden", !this.map);
    this.mark("goal", goal && [goal.x, goal.y]);
    set(this.part("scan"), "d", this.pose ? scan.map(([x, y]) => `M${x} ${y}h0`).join("") : "");
    set(this.part("scan"), "transform", at(this.pose ?? [0, 0]));
    this.draw();
  }

  // A goal, or a wish, at a place, or nowhere
  mark(name, place) {
    this.part(name).toggleAttribute("hidden", !place);
    set(this.part(name), "transform", at(place ?? [0, 0]));
  }

  draw() {
    const {clientWidth: width, clientHeight: height} = this.box;
    const pose = this.pose ?? [0, 0, 0];
    let [x, y] = pose;
    let pixels = Math.sqrt(width * height) / SHOWN[Number(this.whole)] || 1;
    if (this.whole && this.map && width) {
      pixels = 0.9 * Math.min(height / this.map.width, width / this.map.height);
      [x, y] = [this.map.origin[0] + this.map.width / 2, this.map.origin[1] + this.map.height / 2];
    }
    const up = this.headingUp && !this.whole ? pose[2] : 0;
    this.towards = [Math.sin(up), -Math.cos(up), -Math.cos(up), -Math.sin(up)];
    this.show(x, y, pixels);
    this.part("robot").toggleAttribute("hidden", !this.pose);
    set(this.part("robot"), "transform", `${at(pose)} scale(${Math.max(this.radius, SMALLEST / pixels)})`);
  }
}
