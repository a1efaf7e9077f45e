import {set} from "./page.js";

// A floor as SVG: the group .world in `box` is in metres, everything in it is drawn by the browser when it changes.
export class Floor {
  towards = [1, 0, 0, -1]; // the directions on the screen, right and down, of the floor's x and of its y

  constructor(box) {
    this.box = box;
  }

  part(name) {
    return this.box.querySelector(`.${name}`);
  }

  // (x, y) [m] in the middle, at so many pixels per metre; lengths in pixels are `--px` in the style sheet.
  show(x, y, pixels) {
    const [a, b, c, d] = this.towards.map((part) => part * pixels);
    set(this.part("world"), "transform", `matrix(${a} ${b} ${c} ${d} ${-a * x - c * y} ${-b * x - d * y})`);
    this.box.style.setProperty("--px", 1 / pixels);
  }

  // [x, y] [m] of a point on the screen
  place(clientX, clientY) {
    const {x, y} = new DOMPoint(clientX, clientY).matrixTransform(this.part("world").getScreenCTM().inverse());
    return [x, y];
  }

  // The map of a `url`, {width, height, origin} [m, rad]
  showMap(url, {width, height, origin}) {
    const image = this.box.querySelector("image");
    image.onerror = () => image.removeAttribute("href"); // no connection: the next status asks again
    if (image.getAttribute("href") !== url) {
      image.setAttribute("href", url);
      image.setAttribute("width", width);
      image.setAttribute("height", height);
      image.setAttribute("transform", `${at(origin)} matrix(1 0 0 -1 0 ${height})`);
      this.part("outside")?.setAttribute("d", `M-999-999H999V999H-999ZM0 0V${height}H${width}V0Z`);
      this.part("outside")?.setAttribute("transform", at(origin));
    }
  }
}

// The transform to (x [m], y [m], yaw [rad])
export const at = ([x, y, yaw = 0]) => `translate(${x} ${y}) rotate(${yaw * 180 / Math.PI})`;
