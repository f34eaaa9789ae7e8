// Draws the same as painter.js on a plain canvas, for browsers without WebGL2 or whose processor stands in for a graphics
// card: that is faster here.

import { SHADES } from "./colour.js";
import { beyondMark, traceMark } from "./marks.js";

// Shades that are distinguished: each is one path.
const STEPS = 64;
// Particles nearer to each other, in device pixels, are squares of pixels: their cells, bonds and outlines could not be seen.
const DENSE = 4;
// Bodies of more particles are set pixel by pixel as long as cells are smaller than this, in device pixels: to fill a path takes
// longer than its few pixels do.
const MANY = 2000;
const SMALL = 24;
// Width of the line around each triangle, in device pixels: both edges of two neighbours are soft, and paper shows between.
const SEAM = 1.5;
// Places farther from the canvas, in device pixels, are nowhere.
const FAR = 1e5;

export class PlainPainter {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
  }

  setMesh({ bonds, triangles }) {
    this.bonds = bonds;
    this.triangles = triangles;
  }

  draw(scene) {
    const { canvas, pen } = this;
    const { camera, layers } = scene;
    pen.clearRect(0, 0, canvas.width, canvas.height);
    if (scene.spacing < DENSE && (layers.surface || layers.points)) return this.squares(scene);
    if (scene.spacing < SMALL && scene.values.length > MANY) return this.pixels(scene);
    const [left, top] = [canvas.width / 2, canvas.height / 2];
    this.x = (i) => left + (scene.places[2 * i] - camera.x) * camera.scale;
    this.y = (i) => top - (scene.places[2 * i + 1] - camera.y) * camera.scale;
    if (layers.surface) this.surface(scene);
    if (layers.bonds) this.lines(scene);
    if (layers.points) this.dots(scene);
  }

  // Calls `trace` for the items of each shade in turn, and fills; with `seam`, the width of a line in the same colour that
  // covers the seams between them.
  inShades(count, valueOf, { palette, isFlat }, trace, seam = 0) {
    const bins = new Map();
    for (let n = 0; n < count; n++) {
      const shade = shadeOf(valueOf(n));
      const bin = isFlat || shade === SHADES ? shade : Math.round((shade * (STEPS - 1)) / (SHADES - 1)) * 1000;
      if (!bins.has(bin)) bins.set(bin, { shade, items: [] });
      bins.get(bin).items.push(n);
    }
    for (const { shade, items } of bins.values()) {
      this.pen.beginPath();
      items.forEach(trace);
      this.pen.fillStyle = `rgb(${palette.slice(4 * shade, 4 * shade + 3).join(" ")})`;
      this.pen.fill();
      if (!seam) continue;
      Object.assign(this.pen, { strokeStyle: this.pen.fillStyle, lineWidth: seam, lineJoin: "round" });
      this.pen.stroke();
    }
  }

  // The image that pixels are set in, with nothing in it.
  blank() {
    const { canvas, pen } = this;
    const { width, height } = canvas;
    if (this.image?.width !== width || this.image?.height !== height) this.image = pen.createImageData(width, height);
    return new Uint32Array(this.image.data.buffer).fill(0);
  }

  // A surface has no gaps where the body is stretched by a quarter.
  squares({ places, values, palette, camera, spacing, layers }) {
    const { width, height } = this.canvas;
    const pixels = this.blank();
    const colourOf = inPalette(palette);
    const half = layers.surface ? 0.625 * spacing + 0.5 : Math.max(0.27 * spacing, 0.8);
    const [left, top] = [width / 2 - camera.x * camera.scale, height / 2 + camera.y * camera.scale];
    for (let i = 0; i < values.length; i++) {
      const x = left + places[2 * i] * camera.scale;
      const y = top - places[2 * i + 1] * camera.scale;
      // Also those that are nowhere.
      if (!(x > -half && x < width + half && y > -half && y < height + half)) continue;
      const colour = colourOf(values[i]);
      const from = Math.max(Math.round(x - half), 0);
      const to = Math.min(Math.round(x + half), width);
      const last = Math.min(Math.round(y + half), height);
      for (let row = Math.max(Math.round(y - half), 0); row < last; row++) {
        // A call of fill costs more than a few pixels.
        for (let at = row * width + from; at < row * width + to; at++) pixels[at] = colour;
      }
    }
    this.pen.putImageData(this.image, 0, 0);
  }

  // Cells, bonds and dots as on paths, but for the soft edges of cells and bonds.
  pixels(scene) {
    const { places, camera, values, layers } = scene;
    const [left, top] = [this.canvas.width / 2 - camera.x * camera.scale, this.canvas.height / 2 + camera.y * camera.scale];
    const [x, y] = [new Float32Array(values.length), new Float32Array(values.length)];
    for (let i = 0; i < values.length; i++) {
      x[i] = left + places[2 * i] * camera.scale;
      y[i] = top - places[2 * i + 1] * camera.scale;
    }
    const canvas = { pixels: this.blank(), width: this.canvas.width, height: this.canvas.height };
    if (layers.surface) this.setTriangles(canvas, scene, x, y);
    if (layers.bonds) this.setLines(canvas, scene, x, y);
    if (layers.points) setDots(canvas, scene, x, y);
    this.pen.putImageData(this.image, 0, 0);
  }

  setTriangles(canvas, scene, x, y) {
    const { triangles } = this;
    const { trianglesFrom, triangleCount } = scene;
    const colourOf = inPalette(scene.palette);
    for (let n = trianglesFrom; n < trianglesFrom + triangleCount; n += 3) {
      const a = triangles[n];
      const b = triangles[n + 1];
      const c = triangles[n + 2];
      setTriangle(canvas, x[a], y[a], x[b], y[b], x[c], y[c], colourOf(ofTriangle(scene, a, b, c)));
    }
  }

  setLines({ pixels, width, height }, { bondsFrom, bondCount, bondColour, layers }, x, y) {
    const { bonds } = this;
    const colour = bondColour[0] | (bondColour[1] << 8) | (bondColour[2] << 16);
    const cover = layers.surface ? 90 : 230;
    for (let n = bondsFrom; n < bondsFrom + bondCount; n += 2) {
      let column = x[bonds[n]];
      let row = y[bonds[n]];
      let right = x[bonds[n + 1]] - column;
      let down = y[bonds[n + 1]] - row;
      const steps = Math.ceil(Math.max(Math.abs(right), Math.abs(down)));
      if (!(steps < FAR)) continue;
      right /= steps;
      down /= steps;
      for (let k = 0; k < steps; k++, column += right, row += down) {
        if (!(column >= 0 && column < width && row >= 0 && row < height)) continue;
        const at = (row | 0) * width + (column | 0);
        pixels[at] = mixed(pixels[at], colour, cover);
      }
    }
  }

  surface(scene) {
    const { triangles, pen } = this;
    const from = scene.trianglesFrom / 3;
    const corner = (n, k) => triangles[3 * (from + n) + k];
    const valueOf = (n) => ofTriangle(scene, corner(n, 0), corner(n, 1), corner(n, 2));
    this.inShades(scene.triangleCount / 3, valueOf, scene, (n) => {
      pen.moveTo(this.x(corner(n, 0)), this.y(corner(n, 0)));
      pen.lineTo(this.x(corner(n, 1)), this.y(corner(n, 1)));
      pen.lineTo(this.x(corner(n, 2)), this.y(corner(n, 2)));
      pen.closePath();
    }, SEAM);
  }

  lines({ bondsFrom, bondCount, bondColour, layers }) {
    const { pen, bonds } = this;
    pen.beginPath();
    for (let n = bondsFrom; n < bondsFrom + bondCount; n += 2) {
      pen.moveTo(this.x(bonds[n]), this.y(bonds[n]));
      pen.lineTo(this.x(bonds[n + 1]), this.y(bonds[n + 1]));
    }
    pen.strokeStyle = `rgb(${bondColour.join(" ")} / ${layers.surface ? 0.35 : 0.9})`;
    pen.lineWidth = 1;
    pen.stroke();
  }

  dots(scene) {
    const { pen } = this;
    this.inShades(scene.values.length, (i) => scene.values[i], scene, (i) => {
      const [x, y, radius] = [this.x(i), this.y(i), Math.max(scene.radii[i], 0.8)];
      if (radius < 1.5) {
        pen.rect(x - radius, y - radius, 2 * radius, 2 * radius);
      } else traceMark(pen, scene.marks[i], x, y, radius);
    });
  }
}

function shadeOf(value) {
  return value < -0.5 ? SHADES : Math.round(Math.min(Math.max(value, 0), 1) * (SHADES - 1));
}

// Of a value, as a pixel.
function inPalette(palette) {
  const colours = new Uint32Array(Uint8Array.from(palette).buffer);
  return (value) => colours[shadeOf(value)];
}

// The value of a triangle with these corners.
function ofTriangle({ values, isFlat }, a, b, c) {
  if (isFlat) return values[c];
  const isNone = values[a] < -0.5 || values[b] < -0.5 || values[c] < -0.5;
  return isNone ? -1 : (values[a] + values[b] + values[c]) / 3;
}

// A pixel of which so many parts of 256 are covered by a colour.
function mixed(under, colour, cover) {
  if (under === 0) return (colour & 0xffffff) | (cover << 24);
  const rest = 256 - cover;
  const redBlue = ((Math.imul(under & 0xff00ff, rest) + Math.imul(colour & 0xff00ff, cover)) >>> 8) & 0xff00ff;
  const green = ((Math.imul(under & 0xff00, rest) + Math.imul(colour & 0xff00, cover)) >>> 8) & 0xff00;
  return redBlue | green | (Math.max(under >>> 24, cover) << 24);
}

// The pixels whose middles lie in it: of triangles that share an edge each has its own.
function setTriangle({ pixels, width, height }, ax, ay, bx, by, cx, cy, colour) {
  const low = Math.min(ay, by, cy);
  const high = Math.max(ay, by, cy);
  if (!(Math.max(ax, bx, cx) - Math.min(ax, bx, cx) < FAR && high - low < FAR)) return;
  const last = Math.min(Math.ceil(high - 0.5), height);
  for (let row = Math.max(Math.ceil(low - 0.5), 0); row < last; row++) {
    const at = row + 0.5;
    // Two of its edges are cut.
    const ab = ay > at === by > at ? NaN : ax + ((at - ay) / (by - ay)) * (bx - ax);
    const bc = by > at === cy > at ? NaN : bx + ((at - by) / (cy - by)) * (cx - bx);
    const ca = cy > at === ay > at ? NaN : cx + ((at - cy) / (ay - cy)) * (ax - cx);
    const one = Number.isNaN(ab) ? bc : ab;
    const other = Number.isNaN(ca) ? bc : ca;
    const from = Math.max(Math.ceil(Math.min(one, other) - 0.5), 0);
    const end = row * width + Math.min(Math.ceil(Math.max(one, other) - 0.5), width);
    for (let pixel = row * width + from; pixel < end; pixel++) pixels[pixel] = colour;
  }
}

// Within half a pixel of their rims they are covered in part.
function setDots(canvas, scene, x, y) {
  const { pixels, width, height } = canvas;
  const { values, radii, palette, marks } = scene;
  const colourOf = inPalette(palette);
  for (let i = 0; i < values.length; i++) {
    if (marks[i]) {
      setMark(canvas, marks[i], x[i], y[i], Math.max(radii[i], 0.8), colourOf(values[i]));
      continue;
    }
    const radius = Math.max(radii[i], 0.8);
    const [inner, outer] = [(radius - 0.5) ** 2, (radius + 0.5) ** 2];
    const left = Math.max(Math.floor(x[i] - radius - 0.5), 0);
    const right = Math.min(Math.ceil(x[i] + radius + 0.5), width);
    const bottom = Math.min(Math.ceil(y[i] + radius + 0.5), height);
    const colour = colourOf(values[i]);
    for (let row = Math.max(Math.floor(y[i] - radius - 0.5), 0); row < bottom; row++) {
      const down = (row + 0.5 - y[i]) ** 2;
      for (let column = left, at = row * width + left; column < right; column++, at++) {
        const away = (column + 0.5 - x[i]) ** 2 + down;
        if (away <= inner) pixels[at] = colour;
        else if (away < outer) pixels[at] = mixed(pixels[at], colour, (256 * (outer - away)) / (outer - inner));
      }
    }
  }
}

// A mark that is no dot, likewise.
function setMark({ pixels, width, height }, mark, x, y, radius, colour) {
  const reach = 1.25 * radius + 1;
  const left = Math.max(Math.floor(x - reach), 0);
  const right = Math.min(Math.ceil(x + reach), width);
  const bottom = Math.min(Math.ceil(y + reach), height);
  for (let row = Math.max(Math.floor(y - reach), 0); row < bottom; row++) {
    for (let column = left; column < right; column++) {
      const cover = 0.5 - beyondMark(mark, column + 0.5 - x, row + 0.5 - y, radius);
      const at = row * width + column;
      if (cover >= 1) pixels[at] = colour;
      else if (cover > 0) pixels[at] = mixed(pixels[at], colour, 256 * cover);
    }
  }
}
