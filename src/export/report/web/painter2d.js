// Draws the same as painter.js on a plain canvas, for browsers without WebGL2 or whose processor stands in for a graphics
// card: that is faster here.

import { SHADES } from "./colour.js";

// Shades that are distinguished: each is one path.
const STEPS = 64;
// Particles nearer to each other, in device pixels, are squares of pixels: their cells, bonds and outlines could not be seen.
const DENSE = 4;

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
    const [left, top] = [canvas.width / 2, canvas.height / 2];
    this.x = (i) => left + (scene.places[2 * i] - camera.x) * camera.scale;
    this.y = (i) => top - (scene.places[2 * i + 1] - camera.y) * camera.scale;
    if (layers.surface) this.surface(scene);
    if (layers.bonds) this.lines(scene);
    if (layers.points) this.dots(scene);
  }

  // Calls `trace` for the items of each shade in turn, and fills.
  inShades(count, valueOf, { palette, isFlat }, trace) {
    const bins = new Map();
    for (let n = 0; n < count; n++) {
      const value = valueOf(n);
      const shade = value < -0.5 ? SHADES : Math.round(Math.min(Math.max(value, 0), 1) * (SHADES - 1));
      const bin = isFlat || shade === SHADES ? shade : Math.round((shade * (STEPS - 1)) / (SHADES - 1)) * 1000;
      if (!bins.has(bin)) bins.set(bin, { shade, items: [] });
      bins.get(bin).items.push(n);
    }
    for (const { shade, items } of bins.values()) {
      this.pen.beginPath();
      items.forEach(trace);
      this.pen.fillStyle = `rgb(${palette.slice(4 * shade, 4 * shade + 3).join(" ")})`;
      this.pen.fill();
    }
  }

  // A surface has no gaps where the body is stretched by a quarter.
  squares({ places, values, palette, camera, spacing, layers }) {
    const { canvas, pen } = this;
    const { width, height } = canvas;
    if (this.image?.width !== width || this.image?.height !== height) this.image = pen.createImageData(width, height);
    const pixels = new Uint32Array(this.image.data.buffer);
    pixels.fill(0);
    const colours = new Uint32Array(Uint8Array.from(palette).buffer);
    const half = layers.surface ? 0.625 * spacing + 0.5 : Math.max(0.27 * spacing, 0.8);
    const [left, top] = [width / 2 - camera.x * camera.scale, height / 2 + camera.y * camera.scale];
    for (let i = 0; i < values.length; i++) {
      const x = left + places[2 * i] * camera.scale;
      const y = top - places[2 * i + 1] * camera.scale;
      // Also those that are nowhere.
      if (!(x > -half && x < width + half && y > -half && y < height + half)) continue;
      const value = values[i];
      const colour = colours[value < -0.5 ? SHADES : Math.round(Math.min(Math.max(value, 0), 1) * (SHADES - 1))];
      const from = Math.max(Math.round(x - half), 0);
      const to = Math.min(Math.round(x + half), width);
      const last = Math.min(Math.round(y + half), height);
      for (let row = Math.max(Math.round(y - half), 0); row < last; row++) {
        // A call of fill costs more than a few pixels.
        for (let at = row * width + from; at < row * width + to; at++) pixels[at] = colour;
      }
    }
    pen.putImageData(this.image, 0, 0);
  }

  surface(scene) {
    const { triangles, pen } = this;
    const from = scene.trianglesFrom / 3;
    const corner = (n, k) => triangles[3 * (from + n) + k];
    const mean = (n) => {
      const values = [0, 1, 2].map((k) => scene.values[corner(n, k)]);
      return scene.isFlat ? values[2] : Math.min(...values) < -0.5 ? -1 : (values[0] + values[1] + values[2]) / 3;
    };
    this.inShades(scene.triangleCount / 3, mean, scene, (n) => {
      pen.moveTo(this.x(corner(n, 0)), this.y(corner(n, 0)));
      pen.lineTo(this.x(corner(n, 1)), this.y(corner(n, 1)));
      pen.lineTo(this.x(corner(n, 2)), this.y(corner(n, 2)));
    });
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
      } else {
        pen.moveTo(x + radius, y);
        pen.arc(x, y, radius, 0, 7);
      }
    });
  }
}
