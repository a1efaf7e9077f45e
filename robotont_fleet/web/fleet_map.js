// All robots on one map.
const MARGIN = 1, LEAST = 4;  // [m] around the robots; the smallest ground
const CROWD = 12;             // robots whose names would hide each other
const image = new Image();
let shown = {scale: 1, left: 0, top: 0};

// [m] on the map of a place [px] on the canvas.
export function placeOf(x, y) {
  return [x / shown.scale + shown.left, shown.top - y / shown.scale];
}

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

export function draw(canvas, view, chosen) {
  const robots = view.robots.filter((robot) => robot.frame === "map" && robot.pose);
  const {width, height} = canvas.getBoundingClientRect();
  if (!width || !(robots.length || view.ground)) {
    return;
  }
  const ratio = devicePixelRatio, [x0, x1, y0, y1] = bounds({robots, ground: view.ground});
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const scale = Math.min(width / Math.max(LEAST, x1 - x0), height / Math.max(LEAST, y1 - y0));
  shown = {scale, left: (x0 + x1) / 2 - width / 2 / scale, top: (y0 + y1) / 2 + height / 2 / scale};
  const pen = canvas.getContext("2d"), colour = (name) => getComputedStyle(canvas).getPropertyValue(`--${name}`);
  const across = (x) => (x - shown.left) * scale, down = (y) => (shown.top - y) * scale;
  pen.scale(ratio, ratio);
  if (view.ground) {
    if (!image.src) {
      image.src = "map.png";
    }
    const {x, y, width: wide, height: high} = view.ground;
    pen.imageSmoothingEnabled = false;
    if (image.complete && image.naturalWidth) {
      pen.drawImage(image, across(x), down(y + high), wide * scale, high * scale);
    }
  }
  pen.strokeStyle = colour("line");
  pen.beginPath();
  for (let x = Math.ceil(shown.left); across(x) < width; x++) {
    pen.moveTo(across(x), 0);
    pen.lineTo(across(x), height);
  }
  for (let y = Math.floor(shown.top); down(y) < height; y--) {
    pen.moveTo(0, down(y));
    pen.lineTo(width, down(y));
  }
  pen.stroke();
  pen.font = `600 ${robots.length > CROWD ? 11 : 14}px system-ui, sans-serif`;
  pen.textAlign = "center";
  const alike = robots.length > CROWD ? sharedLetters(robots.map((robot) => robot.name)) : 0;
  for (const robot of robots) {
    const [x, y, yaw] = robot.pose, size = Math.max(8, 0.15 * scale);
    pen.globalAlpha = robot.present ? 1 : 0.4;
    pen.save();
    pen.translate(across(x), down(y));
    pen.fillStyle = colour(robot.stopped ? "stop" : robot.id === chosen ? "trail" : "accent");
    pen.beginPath();
    pen.arc(0, 0, size, 0, 2 * Math.PI);
    pen.fill();
    pen.rotate(-yaw);
    pen.strokeStyle = colour("on-accent");
    pen.lineWidth = 3;
    pen.beginPath();
    pen.moveTo(0, 0);
    pen.lineTo(size, 0);
    pen.stroke();
    pen.restore();
    pen.lineWidth = 3;
    pen.strokeStyle = colour("surface");
    pen.strokeText(robot.name.slice(alike), across(x), down(y) - size - 5);
    pen.fillStyle = colour("text");
    pen.fillText(robot.name.slice(alike), across(x), down(y) - size - 5);
    pen.lineWidth = 1;
    pen.globalAlpha = 1;
  }
}
