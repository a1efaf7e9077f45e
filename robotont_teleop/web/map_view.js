// The robot from above: map, trail, scan, goal, robot. The map's x points up and its y to the left (REP 103), or the
// robot's.
import {World, at} from "./floor_svg.js";

const TRAIL_STEP = 0.02;   // [m] between two points of the trail
const TRAIL_LONGEST = 2000;
const JUMP = 0.5;          // [m] a longer step is no driving: the trail starts anew
const SCAN_SHOWN = 500;    // [ms] without a newer status
const AHEAD = [15, 0.1];   // steps, and how long one is [s], of the path ahead
const SMALLEST = 6;        // [px] radius of the drawn robot
const SCALE_BAR = 44;      // [px] at least
const THUMBNAIL = 310;     // [px] what is narrower shows twice as much
const SCALES = [20, 30, 45, 70, 100, 150, 220, 330]; // [px/m]

export class View {
  constructor(svg) {
    this.world = new World(svg);
    this.svg = svg;
    this.scale = 4;
    this.whole = this.headingUp = false; // whether all of the map is shown; whether the robot looks up, not the map
    this.pose = this.map = this.frame = null;
    this.radius = 0.15; // [m] of the robot
    this.trail = [];
    this.scanEnd = null; // timer
  }

  part(name) {
    return this.svg.querySelector(`.${name}`);
  }

  // change: of scale, whole, headingUp
  look(change) {
    Object.assign(this, {whole: false}, change);
    this.scale = Math.min(SCALES.length - 1, Math.max(0, this.scale));
    this.draw();
  }

  // live: whether it is that of now; velocity: [ahead, left, turn] or nothing
  setPose(pose, live, velocity) {
    live &&= pose !== null && !pose.includes(null);
    this.part("robot").classList.toggle("live", live);
    this.part("ahead").setAttribute("points", live && velocity?.some(Boolean) ? pathAhead(...velocity).join(" ") : "");
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

  setStatus({frame, map, goal, radius, scan}) {
    this.radius = radius || this.radius;
    this.map = frame === "map" ? map : null;
    if (map) {
      this.world.showMap(`map.png?number=${map.number}`, map);
    }
    if (frame !== this.frame) {
      this.frame = frame;
      this.trail = [];
      this.part("trail").setAttribute("points", "");
    }
    this.part("ground").toggleAttribute("hidden", !this.map);
    this.mark("goal", goal && [goal.x, goal.y]);
    this.setScan(this.pose && scan || {from: [0, 0], ranges: []});
    this.draw();
  }

  setScan({from, first, step, ranges}) {
    const points = ranges.map((range, ray) => range !== null &&
      `M${range * Math.cos(first + ray * step)} ${range * Math.sin(first + ray * step)}h0`);
    this.part("scan").setAttribute("d", points.filter(Boolean).join(""));
    this.part("scan").setAttribute("transform", at(this.pose || [0, 0]) + at(from));
    clearTimeout(this.scanEnd);
    this.scanEnd = setTimeout(() => this.part("scan").setAttribute("d", ""), SCAN_SHOWN);
  }

  // A goal, or a wish, at a place, or nowhere
  mark(name, place) {
    this.part(name).toggleAttribute("hidden", !place);
    if (place) {
      this.part(name).setAttribute("transform", at(place));
    }
  }

  // {metres, pixels} of a bar that shows the scale
  get scaleBar() {
    const metres = [0.25, 0.5, 1, 2, 5, 10, 20].find((length) => length * this.world.pixels >= SCALE_BAR) || 50;
    return {metres, pixels: metres * this.world.pixels};
  }

  draw() {
    const {clientWidth: width, clientHeight: height} = this.svg;
    const pose = this.pose || [0, 0, 0];
    let [x, y] = pose;
    let pixels = SCALES[this.scale] / (width < THUMBNAIL ? 2 : 1);
    if (this.whole && this.map && width) {
      pixels = 0.9 * Math.min(height / this.map.width, width / this.map.height);
      [x, y] = [this.map.origin[0] + this.map.width / 2, this.map.origin[1] + this.map.height / 2];
    }
    const up = this.headingUp && !this.whole ? pose[2] : 0;
    this.world.towards = [Math.sin(up), -Math.cos(up), -Math.cos(up), -Math.sin(up)];
    this.world.show(x, y, pixels);
    this.svg.dataset.grid = pixels >= 100 ? "quarters" : pixels >= 45 ? "halves" : "whole";
    this.part("robot").toggleAttribute("hidden", !this.pose);
    this.part("robot").setAttribute("transform", `${at(pose)} scale(${Math.max(this.radius, SMALLEST / pixels)})`);
    this.part("ahead").setAttribute("transform", at(pose));
    this.part("ahead").style.strokeWidth = 2 * this.radius;
  }
}

// Where a robot that goes on as now will be [m], from where it is
function pathAhead(ahead, left, turn) {
  let [x, y] = [0, 0];
  const [steps, lasts] = AHEAD;
  return Array.from({length: steps}, (_, step) => {
    const yaw = turn * (step + 0.5) * lasts;
    x += (ahead * Math.cos(yaw) - left * Math.sin(yaw)) * lasts;
    y += (ahead * Math.sin(yaw) + left * Math.cos(yaw)) * lasts;
    return [x, y];
  });
}
