// A floor as SVG: the group .world of `svg` is in metres, everything in it is drawn by the browser when it changes.
export class World {
  // towards: the directions on the screen, right and down, of the floor's x and of its y
  constructor(svg, towards) {
    this.svg = svg;
    this.towards = towards;
    this.group = svg.querySelector(".world");
  }

  // (x, y) [m] in the middle, at so many pixels per metre; lengths in pixels are `--px` in the style sheet.
  show(x, y, pixels) {
    const [a, b, c, d] = this.towards.map((part) => part * pixels);
    this.group.setAttribute("transform", `matrix(${a} ${b} ${c} ${d} ${-a * x - c * y} ${-b * x - d * y})`);
    if (this.pixels !== pixels) {
      this.pixels = pixels;
      this.svg.style.setProperty("--px", 1 / pixels);
    }
  }

  // [x, y] [m] of a point on the screen
  place(clientX, clientY) {
    const {x, y} = new DOMPoint(clientX, clientY).matrixTransform(this.group.getScreenCTM().inverse());
    return [x, y];
  }

  // The map of a `url`, {width, height, origin} [m, rad]
  showMap(url, {width, height, origin}) {
    const image = this.group.querySelector("image");
    image.onerror = () => image.removeAttribute("href"); // no connection: the next status asks again
    if (image.getAttribute("href") !== url) {
      image.setAttribute("href", url);
      image.setAttribute("width", width);
      image.setAttribute("height", height);
      image.setAttribute("transform", `${at(origin)} matrix(1 0 0 -1 0 ${height})`);
      const outside = this.group.querySelector(".outside");
      outside?.setAttribute("d", `M-999-999H999V999H-999ZM0 0V${height}H${width}V0Z`);
      outside?.setAttribute("transform", at(origin));
    }
  }
}

// The transform to (x [m], y [m], yaw [rad])
export const at = ([x, y, yaw = 0]) => `translate(${x} ${y}) rotate(${yaw * 180 / Math.PI})`;
