// What stays in its place while the robot moves: grid, map and trail, painted once on a canvas larger than the view and
// shifted from then on, until the robot comes near its edge.
const SPARE = 0.25; // of the view's width and height that the canvas reaches further on each side

// World coordinates [m] for a canvas that shows (x, y) in its middle, `pixels` of it per metre: x up, y to the left
export function useWorld(context, {x, y}, pixels) {
  const {width, height} = context.canvas;
  context.setTransform(0, -pixels, -pixels, 0, width / 2 + y * pixels, height / 2 + x * pixels);
}

export class Ground {
  constructor() {
    this.context = document.createElement("canvas").getContext("2d");
    this.middle = null; // {x, y} [m] in the middle of the canvas, null: nothing is painted
  }

  // What was painted holds no longer.
  clear() {
    this.middle = null;
  }

  // Paint it around `middle` {x, y} [m] on a canvas of the view, whose scale is `pixels` per metre. `scene`: {map,
  // mapImage, trail, tint, gridStep [m], ratio} of the view.
  paintOn(view, middle, pixels, scene) {
    const {width, height} = view.canvas;
    const {canvas} = this.context;
    if (this.middle === null || Math.abs(middle.x - this.middle.x) * pixels > SPARE * height ||
        Math.abs(middle.y - this.middle.y) * pixels > SPARE * width) {
      canvas.width = Math.ceil(width * (1 + 2 * SPARE));
      canvas.height = Math.ceil(height * (1 + 2 * SPARE));
      this.middle = {...middle};
      this.paint(pixels, scene);
    }
    view.setTransform(1, 0, 0, 1, 0, 0);
    view.clearRect(0, 0, width, height);
    view.drawImage(canvas, Math.round((width - canvas.width) / 2 + (middle.y - this.middle.y) * pixels),
      Math.round((height - canvas.height) / 2 + (middle.x - this.middle.x) * pixels));
  }

  paint(pixels, scene) {
    useWorld(this.context, this.middle, pixels);
    this.paintGrid(pixels, scene);
    if (scene.map && scene.mapImage) {
      this.paintMap(scene);
    }
    this.paintTrail(scene.trail, pixels, scene);
  }

  paintGrid(pixels, {gridStep, tint, ratio}) {
    const context = this.context;
    const {x, y} = this.middle;
    const [far, wide] = [context.canvas.height / pixels / 2, context.canvas.width / pixels / 2];
    for (const whole of [false, true]) { // metres, and parts of them
      const isShown = (line) => (Math.abs(line - Math.round(line)) < 1e-6) === whole;
      context.beginPath();
      for (const line of multiples(gridStep, x - far, x + far).filter(isShown)) {
        context.moveTo(line, y - wide);
        context.lineTo(line, y + wide);
      }
      for (const line of multiples(gridStep, y - wide, y + wide).filter(isShown)) {
        context.moveTo(x - far, line);
        context.lineTo(x + far, line);
      }
      context.globalAlpha = whole ? 1 : 0.45;
      context.strokeStyle = tint.line;
      context.lineWidth = ratio / pixels;
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  paintMap({map: {width, height, origin}, mapImage}) {
    const context = this.context;
    context.save();
    context.translate(origin[0], origin[1]);
    context.rotate(origin[2]);
    context.translate(0, height);
    context.scale(1, -1);
    context.imageSmoothingEnabled = false;
    context.drawImage(mapImage, 0, 0, width, height);
    context.restore();
  }

  // Add a piece of the trail to what is painted.
  extendTrail(points, pixels, scene) {
    if (this.middle !== null) {
      this.paintTrail(points, pixels, scene);
    }
  }

  paintTrail(points, pixels, scene) {
    paintTrail(this.context, points, pixels, scene);
  }
}

export function paintTrail(context, points, pixels, {tint, ratio}) {
  context.beginPath();
  for (const [x, y] of points) {
    context.lineTo(x, y);
  }
  context.strokeStyle = tint.trail;
  context.lineWidth = 3 * ratio / pixels;
  context.lineJoin = context.lineCap = "round";
  context.stroke();
}

function multiples(step, least, greatest) {
  const found = [];
  for (let number = Math.ceil(least / step); number * step <= greatest; number++) {
    found.push(number * step);
  }
  return found;
}
