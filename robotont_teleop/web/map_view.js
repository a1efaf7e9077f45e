// The robot from above: map, trail, scan, goal, robot. World x points up on the screen, y to the left (REP 103).
import {World, at} from "./floor_svg.js";

const TRAIL_STEP = 0.02;   // [m] between two points of the trail
const TRAIL_LONGEST = 2000;
const JUMP = 0.5;          // [m] a longer step is no driving: the trail starts anew
const SCAN_SHOWN = 500;    // [ms] without a newer status
const RADIUS = 0.15;       // [m] of the drawn robot
const SMALLEST = 6;        // [px] the same
const SCALE_BAR = 44;      // [px] at least
const SCALES = [20, 30, 45, 70, 100, 150, 220, 330]; // [px/m]

export class View {
  constructor(svg) {
    this.world = new World(svg, [[0, -1], [-1, 0]]);
    this.svg = svg;
    this.scale = 4;
    this.pose = null;
    this.trail = [];
    this.scanEnd = null; // timer
    this.frame = null;
  }

  part(name) {
    return this.svg.querySelector(`.${name}`);
  }

  zoom(step) {
    this.scale = Math.min(SCALES.length - 1, Math.max(0, this.scale + step));
    this.svg.dataset.grid = SCALES[this.scale] >= 100 ? "quarters" : SCALES[this.scale] >= 45 ? "halves" : "whole";
    this.draw();
  }

  // live: whether it is that of now
  setPose(pose, live = true) {
    live &&= pose !== null && !pose.includes(null);
    this.part("robot").classList.toggle("live", live);
    if (live && pose.some((value, axis) => value !== this.pose?.[axis])) {
      this.pose = pose;
      this.lengthenTrail(pose);
      this.draw();
    }
  }

  lengthenTrail([x, y]) {
    const last = this.trail[this.trail.length - 1];
    const step = last ? Math.hypot(x - last[0], y - last[1]) : Infinity;
    if (step > TRAIL_STEP) {
      this.trail = [...(step > JUMP ? [] : this.trail.slice(1 - TRAIL_LONGEST)), [x, y]];
      this.part("trail").setAttribute("points", this.trail.join(" "));
    }
  }

  setStatus({frame, map, goal}) {
    if (map) {
      this.world.showMap(`map.png?number=${map.number}`, map);
    }
    if (frame !== this.frame) {
      this.frame = frame;
      this.trail = [];
      this.part("trail").setAttribute("points", "");
    }
    this.part("map").toggleAttribute("hidden", !map || frame !== "map");
    this.part("goal").toggleAttribute("hidden", !goal);
    if (goal) {
      this.part("goal").setAttribute("transform", at([goal.x, goal.y]));
    }
  }

  setScan(scan) {
    const {from, first, step, ranges} = this.pose && scan || {from: [0, 0], ranges: []};
    const points = ranges.map((range, ray) => range !== null &&
      `M${range * Math.cos(first + ray * step)} ${range * Math.sin(first + ray * step)}h0`);
    this.part("scan").setAttribute("d", points.filter(Boolean).join(""));
    this.part("scan").setAttribute("transform", at(this.pose || [0, 0]) + at(from));
    clearTimeout(this.scanEnd);
    this.scanEnd = setTimeout(() => this.part("scan").setAttribute("d", ""), SCAN_SHOWN);
  }

  // {metres, pixels} of a bar that shows the scale
  get scaleBar() {
    const pixels = SCALES[this.scale];
    const metres = [0.25, 0.5, 1, 2, 5].find((length) => length * pixels >= SCALE_BAR);
    return {metres, pixels: metres * pixels};
  }

  draw() {
    const [x, y] = this.pose || [0, 0];
    this.world.show(x, y, SCALES[this.scale]);
    this.part("robot").toggleAttribute("hidden", !this.pose);
    const radius = Math.max(RADIUS, SMALLEST / SCALES[this.scale]);
    this.part("robot").setAttribute("transform", `${at(this.pose || [0, 0])} scale(${radius})`);
  }
}
