// The robot from above: grid, map, scan, trail, goal. World x points up on the screen, y to the left (REP 103).
const TRAIL_STEP = 0.02;   // [m] between two points of the trail
const TRAIL_LONGEST = 4000;
const JUMP = 0.5;          // [m] a longer step is no driving: the trail starts anew
const RADIUS = 0.15;       // [m] of the drawn robot
const SCALES = [20, 30, 45, 70, 100, 150, 220, 330]; // [px/m]

export class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.scale = 4;
    this.pose = null;
    this.trail = [];
    this.scan = null;
    this.map = null;
    this.mapImage = null;
    this.goal = null;
    this.frame = null;
    this.dirty = false;
    this.tint = {};
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.readColours());
    this.readColours();
    this.resize();
  }

  readColours() {
    const style = getComputedStyle(document.documentElement);
    for (const name of ["line", "text", "accent", "trail", "scan", "robot", "quiet"]) {
      this.tint[name] = style.getPropertyValue(`--${name}`).trim();
    }
    this.draw();
  }

  resize() {
    const box = this.canvas.parentElement.getBoundingClientRect();
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.width = box.width;
    this.height = box.height;
    this.canvas.width = Math.round(box.width * ratio);
    this.canvas.height = Math.round(box.height * ratio);
    this.ratio = ratio;
    this.draw();
  }

  zoom(step) {
    this.scale = Math.min(SCALES.length - 1, Math.max(0, this.scale + step));
    this.draw();
  }

  setPose(pose) {
    if (pose === null || pose.includes(null)) {
      return;
    }
    this.pose = pose;
    const last = this.trail[this.trail.length - 1];
    const step = last ? Math.hypot(pose[0] - last[0], pose[1] - last[1]) : Infinity;
    if (step > JUMP) {
      this.trail = [];
    }
    if (step > TRAIL_STEP) {
      this.trail.push([pose[0], pose[1]]);
      if (this.trail.length > TRAIL_LONGEST) {
        this.trail.splice(0, TRAIL_LONGEST / 4);
      }
    }
    this.draw();
  }

  setStatus(status) {
    if (status.frame !== this.frame) {
      this.frame = status.frame;
      this.trail = [];
    }
    this.goal = status.goal;
    if (status.map && status.map.number !== this.map?.number) {
      const image = new Image();
      image.onload = () => {
        this.mapImage = image;
        this.draw();
      };
      image.src = `map.png?number=${status.map.number}`;
    }
    this.map = status.map;
    this.draw();
  }

  setScan(scan) {
    this.scan = {...scan, pose: this.pose};
  }

  // Place in the world [m] of a point on the screen
  place(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const pixels = SCALES[this.scale];
    const [x, y] = this.pose || [0, 0];
    return [x - (clientY - box.top - this.height / 2) / pixels, y - (clientX - box.left - this.width / 2) / pixels];
  }

  draw() {
    if (!this.dirty) {
      this.dirty = true;
      requestAnimationFrame(() => {
        this.dirty = false;
        this.paint();
      });
    }
  }

  paint() {
    const context = this.context;
    const pixels = SCALES[this.scale];
    const [x, y] = this.pose || [0, 0];
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    const k = pixels * this.ratio;
    context.setTransform(0, -k, -k, 0, (this.width / 2) * this.ratio + y * k, (this.height / 2) * this.ratio + x * k);
    this.paintGrid(context, pixels, x, y);
    this.paintMap(context);
    this.paintTrail(context, pixels);
    this.paintScan(context, pixels);
    this.paintGoal(context, pixels);
    if (this.pose) {
      this.paintRobot(context, pixels);
    }
  }

  paintMap(context) {
    if (!this.map || !this.mapImage || this.frame !== "map") {
      return;
    }
    const {width, height, origin} = this.map;
    context.save();
    context.translate(origin[0], origin[1]);
    context.rotate(origin[2]);
    context.translate(0, height);
    context.scale(1, -1);
    context.imageSmoothingEnabled = false;
    context.drawImage(this.mapImage, 0, 0, width, height);
    context.restore();
  }

  paintGrid(context, pixels, x, y) {
    const step = pixels >= 100 ? 0.25 : pixels >= 45 ? 0.5 : 1;
    const [far, wide] = [this.height / pixels / 2 + step, this.width / pixels / 2 + step];
    for (const whole of [false, true]) {
      context.beginPath();
      for (let line = Math.ceil((x - far) / step) * step; line < x + far; line += step) {
        if ((Math.abs(line - Math.round(line)) < 1e-6) === whole) {
          context.moveTo(line, y - wide);
          context.lineTo(line, y + wide);
        }
      }
      for (let line = Math.ceil((y - wide) / step) * step; line < y + wide; line += step) {
        if ((Math.abs(line - Math.round(line)) < 1e-6) === whole) {
          context.moveTo(x - far, line);
          context.lineTo(x + far, line);
        }
      }
      context.globalAlpha = whole ? 1 : 0.45;
      context.strokeStyle = this.tint.line;
      context.lineWidth = 1 / pixels;
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  paintTrail(context, pixels) {
    if (this.trail.length < 2) {
      return;
    }
    context.beginPath();
    context.moveTo(...this.trail[0]);
    for (const point of this.trail) {
      context.lineTo(...point);
    }
    context.lineTo(this.pose[0], this.pose[1]);
    context.strokeStyle = this.tint.trail;
    context.lineWidth = 3 / pixels;
    context.lineJoin = context.lineCap = "round";
    context.stroke();
  }

  paintScan(context, pixels) {
    if (!this.scan?.pose || performance.now() - this.scan.at > 1000) {
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
    const radius = Math.max(RADIUS, 12 / pixels);
    context.save();
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
