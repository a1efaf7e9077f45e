// The robot from above: ground, scan, goal, robot. World x points up on the screen, y to the left (REP 103).
import {Ground, paintTrail, useWorld} from "./ground.js";

const TRAIL_STEP = 0.02;   // [m] between two points of the trail
const TRAIL_LONGEST = 4000;
const JUMP = 0.5;          // [m] a longer step is no driving: the trail starts anew
const SCAN_SHOWN = 1000;   // [ms] without a newer one
const RADIUS = 0.15;       // [m] of the drawn robot
const SMALLEST = 6;        // [px] the same
const SCALE_BAR = 44;      // [px] at least
const SCALES = [20, 30, 45, 70, 100, 150, 220, 330]; // [px/m]

export class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.scale = 4;
    this.pose = null;
    this.live = false; // whether the pose is that of now
    this.trail = [];
    this.scan = null;
    this.scanEnd = null; // timer
    this.map = null;
    this.mapImage = null;
    this.goal = null;
    this.frame = null;
    this.frameWanted = null;
    this.tint = {};
    this.ground = new Ground();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.readColours());
    this.readColours();
    this.resize();
  }

  readColours() {
    const style = getComputedStyle(document.documentElement);
    for (const name of ["line", "accent", "trail", "scan", "robot"]) {
      this.tint[name] = style.getPropertyValue(`--${name}`).trim();
    }
    this.drawAll();
  }

  resize() {
    const box = this.canvas.parentElement.getBoundingClientRect();
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.width = box.width;
    this.height = box.height;
    this.canvas.width = Math.round(box.width * ratio);
    this.canvas.height = Math.round(box.height * ratio);
    this.ratio = ratio;
    this.drawAll();
  }

  zoom(step) {
    this.scale = Math.min(SCALES.length - 1, Math.max(0, this.scale + step));
    this.drawAll();
  }

  setPose(pose, live = true) {
    live &&= pose !== null && !pose.includes(null);
    if (live !== this.live) {
      this.live = live;
      this.draw();
    }
    if (!live || pose.every((value, axis) => value === this.pose?.[axis])) {
      return;
    }
    this.pose = pose;
    this.lengthenTrail(pose);
    this.draw();
  }

  lengthenTrail([x, y]) {
    const last = this.trail[this.trail.length - 1];
    const step = last ? Math.hypot(x - last[0], y - last[1]) : Infinity;
    if (step > JUMP) {
      this.trail = [[x, y]];
      this.ground.clear();
    } else if (step > TRAIL_STEP) {
      this.trail.push([x, y]);
      this.ground.extendTrail([last, [x, y]], SCALES[this.scale] * this.ratio, this.scene);
      if (this.trail.length > TRAIL_LONGEST) {
        this.trail.splice(0, TRAIL_LONGEST / 4);
      }
    }
  }

  setStatus(status) {
    const {map} = status;
    if (map && map.number !== this.map?.number) {
      const image = new Image();
      image.onload = () => {
        this.mapImage = image;
        this.drawAll();
      };
      image.src = `map.png?number=${map.number}`;
    }
    if (status.frame !== this.frame) {
      this.trail = [];
    }
    if (status.frame !== this.frame || map?.number !== this.map?.number) {
      this.ground.clear();
    }
    this.frame = status.frame;
    this.map = map;
    this.goal = status.goal;
    this.draw();
  }

  setScan(scan) {
    this.scan = {...scan, pose: this.pose};
    this.draw();
    clearTimeout(this.scanEnd);
    this.scanEnd = setTimeout(() => {
      this.scan = null;
      this.draw();
    }, SCAN_SHOWN);
  }

  // {metres, pixels} of a bar that shows the scale
  get scaleBar() {
    const pixels = SCALES[this.scale];
    const metres = [0.25, 0.5, 1, 2, 5].find((length) => length * pixels >= SCALE_BAR);
    return {metres, pixels: metres * pixels};
  }

  // Place in the world [m] of a point on the screen
  place(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const pixels = SCALES[this.scale];
    const [x, y] = this.pose || [0, 0];
    return [x - (clientY - box.top - this.height / 2) / pixels, y - (clientX - box.left - this.width / 2) / pixels];
  }

  draw() {
    this.frameWanted ??= requestAnimationFrame(() => {
      this.frameWanted = null;
      this.paint();
    });
  }

  // Everything anew, with the ground
  drawAll() {
    this.ground.clear();
    this.draw();
  }

  get scene() {
    const shown = this.frame === "map" ? {map: this.map, mapImage: this.mapImage} : {};
    return {...shown, trail: this.trail, tint: this.tint, gridStep: gridStep(SCALES[this.scale]), ratio: this.ratio};
  }

  paint() {
    if (!this.width || !this.height) {
      return;
    }
    const context = this.context;
    const [x, y] = this.pose || [0, 0];
    const pixels = SCALES[this.scale] * this.ratio;
    this.ground.paintOn(context, {x, y}, pixels, this.scene);
    useWorld(context, {x, y}, pixels);
    if (this.trail.length) {
      paintTrail(context, [this.trail[this.trail.length - 1], [x, y]], pixels, this.scene);
    }
    this.paintScan(context, SCALES[this.scale]);
    this.paintGoal(context, SCALES[this.scale]);
    if (this.pose) {
      this.paintRobot(context, SCALES[this.scale]);
    }
  }

  paintScan(context, pixels) {
    if (!this.scan?.pose) {
      return;
    }
    const {pose, from, first, step, ranges} = this.scan;
    context.save();
    context.translate(pose[0], pose[1]);
    context.rotate(pose[2]);
    context.translate(from[0], from[1]);
    context.rotate(from[2]);
    context.fillStyle = this.tint.scan;
    const size = 4 / pixels;
    ranges.forEach((range, ray) => {
      if (range !== null) {
        const angle = first + ray * step;
        context.fillRect(range * Math.cos(angle) - size / 2, range * Math.sin(angle) - size / 2, size, size);
      }
    });
    context.restore();
  }

  paintGoal(context, pixels) {
    if (!this.goal) {
      return;
    }
    context.beginPath();
    context.arc(this.goal.x, this.goal.y, 14 / pixels, 0, 7);
    context.moveTo(this.goal.x + 5 / pixels, this.goal.y);
    context.arc(this.goal.x, this.goal.y, 5 / pixels, 0, 7);
    context.strokeStyle = this.tint.accent;
    context.lineWidth = 3 / pixels;
    context.stroke();
  }

  paintRobot(context, pixels) {
    const radius = Math.max(RADIUS, SMALLEST / pixels);
    context.save();
    context.globalAlpha = this.live ? 1 : 0.4;
    context.translate(this.pose[0], this.pose[1]);
    context.rotate(this.pose[2]);
    context.beginPath();
    context.arc(0, 0, radius, 0, 7);
    context.fillStyle = this.tint.robot;
    context.fill();
    context.strokeStyle = this.tint.accent;
    context.lineWidth = 3 / pixels;
    context.stroke();
    context.beginPath(); // its nose
    context.moveTo(radius * 0.78, 0);
    context.lineTo(-radius * 0.35, radius * 0.5);
    context.lineTo(-radius * 0.1, 0);
    context.lineTo(-radius * 0.35, -radius * 0.5);
    context.closePath();
    context.fillStyle = this.tint.accent;
    context.fill();
    context.restore();
  }
}

// [m] between two lines of the grid
function gridStep(pixels) {
  return pixels >= 100 ? 0.25 : pixels >= 45 ? 0.5 : 1;
}
