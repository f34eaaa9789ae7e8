// One body on its canvases: what stands still below, the painter's in the middle, marks above.

import { Painter } from "./painter.js";
import { PlainPainter } from "./painter2d.js";
import { marksOf } from "./marks.js";
import { multiples, placeWords, themeColour, themeText, ticks, words } from "./colour.js";
import { made, shown } from "./shown.js";

// Ways of more particles would cover each other.
const MOST_WAYS = 400;
// Largest distance of the pointer from a particle that it names, in pixels.
const REACH = 14;

// Smallest radius of a robot where there are few, in pixels: seen in a wide formation, and hit.
const LEAST_ROBOT = 3.5;

// Of broken bonds, in pixels.
export const CRACK_DASH = [3, 2];

// Scenes without a unit call it so.
export function isUnit(unit) {
  return unit !== "" && unit !== "length" && unit !== "unit";
}

export class View {
  constructor(body, parent) {
    this.body = body;
    this.origin = [0, 0];
    // Places are drawn in a unit of a particle's size: single floats go no further than 1e38. A power of two keeps the digits.
    const { spacing } = body.animation;
    this.unit = spacing > 0 ? 2 ** Math.floor(Math.log2(spacing)) : 1;
    this.marked = -1;
    this.kept = -1;
    const { name, noun } = body.animation;
    const label = `${name || "Body"}: ${body.count} ${noun}s. Plus and minus zoom, shift with arrows moves.`;
    [this.under, this.middle, this.over] = [0, 1, 2].map(() => made("canvas"));
    this.box = made("div", { class: "canvas", tabindex: 0, role: "application", "aria-label": label }, this.under, this.middle, this.over);
    const caption = name ? [made("figcaption", {}, name)] : [];
    parent.append(made("figure", { class: "view" }, ...caption, this.box));
    // Where neither is asked for, the one that is faster here.
    const wanted = new URLSearchParams(location.search).get("painter");
    this.painter = (wanted !== "2d" && Painter.on(this.middle, wanted === "webgl")) || new PlainPainter(this.middle);
    this.places = new Float32Array(2 * body.count);
    this.shades = new Float32Array(body.count);
    this.radii = new Float32Array(body.count);
    this.marks = new Uint8Array(body.count);
    this.markOfRole = marksOf(body.animation.role_names);
  }

  // After the body is open.
  prepare() {
    const { body } = this;
    const middle = (values) => values.reduce((sum, value) => sum + value / values.length, 0);
    this.origin = [middle(body.X), middle(body.Y)];
    this.painter.setMesh(body);
  }

  // Lowest and highest places over the frames that are looked at, and whatever stands in the way; as shown.
  bounds(frames, factor, turned) {
    const { body } = this;
    const box = { low: [Infinity, Infinity], high: [-Infinity, -Infinity] };
    const take = (worldX, worldY) => {
      const [x, y] = turned ? [worldY, -worldX] : [worldX, worldY];
      if (!(Number.isFinite(x) && Number.isFinite(y))) return;
      box.low = [Math.min(box.low[0], x), Math.min(box.low[1], y)];
      box.high = [Math.max(box.high[0], x), Math.max(box.high[1], y)];
    };
    const at = body.at;
    for (const frame of frames) {
      body.go(frame);
      for (let i = 0; i < body.count; i++) take(body.X[i] + factor * body.dx[i], body.Y[i] + factor * body.dy[i]);
    }
    if (at >= 0) body.go(at);
    const own = body.animation.radii.length ? Math.max(...body.animation.radii) : 0.5 * body.animation.spacing;
    for (const { corners, moves } of body.animation.outlines.filter(({ kind }) => kind === "obstacle"))
      for (const [, x, y] of [[0, 0, 0], ...moves]) corners.forEach(([px, py]) => take(px + x, py + y));
    return { low: box.low.map((value) => value - own), high: box.high.map((value) => value + own) };
  }

  // Whether it stands on the page.
  get isSeen() {
    return this.box.clientWidth > 0;
  }

  resize() {
    const ratio = shown.sharpness ?? (window.devicePixelRatio || 1);
    const [width, height] = [this.box.clientWidth, this.box.clientHeight];
    for (const canvas of [this.under, this.middle, this.over]) {
      const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
      if (canvas.width === w && canvas.height === h) continue;
      Object.assign(canvas, { width: w, height: h });
      // It is empty now, also where it soon is as large as before.
      [this.below, this.isClear] = ["", false];
    }
    Object.assign(this, { ratio, width, height });
  }

  // A place as it is shown: as it is, or turned by a quarter, so that tall bodies lie.
  shown([x, y]) {
    return this.show.turned ? [y, -x] : [x, y];
  }

  // `show` is what the page shows: frame, camera, factor, turned, layers, shade(body, out), palette, isFlat. The camera
  // is a place as shown.
  draw(show) {
    this.show = show;
    // A finger and the wheel scroll the page as long as there is nothing more to see here.
    this.box.classList.toggle("zoomed", !show.isFitted || Boolean(shown.tool));
    this.resize();
    const { body, places, shades, radii, ratio, unit } = this;
    body.go(show.frame);
    const { X, Y, dx, dy, animation } = body;
    const origin = this.shown(this.origin);
    for (let i = 0; i < body.count; i++) {
      const x = (X[i] + show.factor * dx[i] - this.origin[0]) / unit;
      const y = (Y[i] + show.factor * dy[i] - this.origin[1]) / unit;
      // NaN is culled by some drivers and not by others; far away is outside everywhere.
      const isThere = Number.isFinite(x) && Number.isFinite(y);
      places[2 * i] = isThere ? (show.turned ? y : x) : 1e30;
      places[2 * i + 1] = isThere ? (show.turned ? -x : y) : 1e30;
    }
    show.shade(body, shades);
    const scale = show.camera.scale * ratio;
    const least = (body.count <= MOST_WAYS ? LEAST_ROBOT : 1.5) * ratio;
    if (animation.radii.length) for (let i = 0; i < body.count; i++) radii[i] = Math.max(animation.radii[i] * scale, least);
    else radii.fill(Math.min(Math.max((show.layers.surface ? 0.13 : 0.27) * animation.spacing * scale, 0.7), 9 * ratio));
    if (show.layers.points) body.roles().forEach((role, i) => (this.marks[i] = this.markOfRole[role]));
    const bondsFrom = 2 * body.brokenBonds();
    const trianglesFrom = 3 * body.trianglesPerCell * body.tornCells();
    this.painter.draw({
      places, values: shades, radii, marks: this.marks,
      palette: show.palette, isFlat: show.isFlat, layers: show.layers,
      spacing: animation.radii.length ? Math.max(animation.spacing * scale, 2 * least) : animation.spacing * scale,
      camera: { x: (show.camera.x - origin[0]) / unit, y: (show.camera.y - origin[1]) / unit, scale: scale * unit },
      bondsFrom, bondCount: body.bonds.length - bondsFrom,
      trianglesFrom, triangleCount: body.triangles.length - trianglesFrom,
      bondColour: themeColour("bond"),
    });
    this.drawUnder();
    this.drawOver();
  }

  // From a place to the canvas, in CSS pixels.
  place(at) {
    return this.pixel(this.shown(at));
  }

  pixel([x, y]) {
    const { camera } = this.show;
    return [this.width / 2 + (x - camera.x) * camera.scale, this.height / 2 - (y - camera.y) * camera.scale];
  }

  at(particle) {
    const origin = this.shown(this.origin);
    return this.pixel([0, 1].map((k) => this.unit * this.places[2 * particle + k] + origin[k]));
  }

  pen(canvas) {
    const pen = canvas.getContext("2d");
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    return pen;
  }

  // The corners of an outline where it stands at the frame that is shown.
  corners({ corners, moves }) {
    const now = this.body.animation.times[this.show.frame];
    const [, x, y] = moves.findLast(([time]) => time <= now) ?? [0, 0, 0];
    return x || y ? corners.map(([px, py]) => [px + x, py + y]) : corners;
  }

  // The obstacle under a point of the box, in CSS pixels, by its number; -1 if there is none.
  obstacleAt(px, py) {
    const pen = this.under.getContext("2d");
    const covers = ({ kind, ...outline }) => {
      if (kind !== "obstacle") return false;
      const border = new Path2D();
      this.corners(outline).forEach((corner) => border.lineTo(...this.place(corner)));
      return pen.isPointInPath(border, px * this.ratio, py * this.ratio);
    };
    return this.body.animation.outlines.findIndex(covers);
  }

  drawUnder() {
    // Drawn again only when something of it changed: a frame of an animation moves nothing here but the ways.
    const { camera, turned, factor, layers, frame } = this.show;
    const outlines = this.body.animation.outlines.map((outline) => this.corners(outline));
    const seen = [outlines, camera, turned, factor, this.width, this.height, this.ratio, themeText("card")];
    const key = JSON.stringify(layers.ways ? [...seen, frame] : seen);
    if (key === this.below) return;
    this.below = key;
    this.paintUnder(this.pen(this.under), outlines);
  }

  paintUnder(pen, outlines = this.body.animation.outlines.map((outline) => this.corners(outline))) {
    pen.fillStyle = themeText("card");
    pen.fillRect(0, 0, this.width, this.height);
    this.drawGrid(pen);
    for (const [k, { kind }] of this.body.animation.outlines.entries()) {
      pen.beginPath();
      outlines[k].forEach((corner) => pen.lineTo(...this.place(corner)));
      pen.closePath();
      if (kind === "fence") {
        pen.strokeStyle = themeText("obstacle");
        pen.setLineDash([6, 4]);
        pen.stroke();
        pen.setLineDash([]);
      } else {
        pen.fillStyle = themeText("obstacle");
        pen.fill();
      }
    }
    if (this.show.layers.ways && this.body.count <= MOST_WAYS) this.drawWays(pen);
  }

  // Lines at round coordinates, with their numbers along the lower and the left edge.
  drawGrid(pen) {
    const { camera } = this.show;
    const [halfWidth, halfHeight] = [this.width / 2 / camera.scale, this.height / 2 / camera.scale];
    // On a phone too there are two of them, whose distance is that of the others.
    const across = ticks(camera.x - halfWidth, camera.x + halfWidth, Math.max(this.width / 110, 4));
    const step = across.length > 1 ? Number((across[1] - across[0]).toPrecision(2)) : 1;
    const up = across.length > 1 ? multiples(camera.y - halfHeight, camera.y + halfHeight, step) : [];
    pen.lineWidth = 1;
    pen.strokeStyle = themeText("grid");
    pen.fillStyle = themeText("soft");
    pen.font = "11px system-ui, sans-serif";
    pen.beginPath();
    for (const x of across) {
      const px = Math.round(this.pixel([x, 0])[0]) + 0.5;
      pen.moveTo(px, 0);
      pen.lineTo(px, this.height);
    }
    for (const y of up) {
      const py = Math.round(this.pixel([0, y])[1]) + 0.5;
      pen.moveTo(0, py);
      pen.lineTo(this.width, py);
    }
    pen.stroke();
    // Turned, what lies across is y, and what goes down is x.
    const [h, v] = this.show.turned ? ["y", "x"] : ["x", "y"];
    const { unit } = this.body.animation;
    const named = (name) => (isUnit(unit) ? `${name} [${unit}]` : name);
    for (const x of across) {
      const from = this.pixel([x, 0])[0] + 3;
      const text = placeWords(x, step);
      if (from > 53 && from + pen.measureText(text).width < this.width - 2) pen.fillText(text, from, this.height - 5);
    }
    const between = up.filter((y) => this.pixel([0, y])[1] > 34 && this.pixel([0, y])[1] < this.height - 16);
    between.forEach((y) => pen.fillText(placeWords(this.show.turned ? -y : y, step), 5, this.pixel([0, y])[1] - 3));
    pen.fillText(named(h), this.width - pen.measureText(named(h)).width - 6, 14);
    pen.fillText(named(v), 5, 14);
    // A saved picture says it too.
    const { factor } = this.show;
    if (factor !== 1) pen.fillText(`displacements × ${words(factor)}`, 60, 14);
  }

  // The paths up to now.
  drawWays(pen) {
    const { body, show } = this;
    if (!this.ways || this.ways.length < body.frames.ready) this.collectWays();
    pen.strokeStyle = themeText("way");
    pen.lineWidth = 1;
    pen.beginPath();
    for (let i = 0; i < body.count; i++) {
      let before = null;
      for (let frame = 0; frame <= Math.min(show.frame, this.ways.length - 1); frame++) {
        const [x, y] = this.place([
          body.X[i] + show.factor * this.ways[frame][2 * i],
          body.Y[i] + show.factor * this.ways[frame][2 * i + 1],
        ]);
        if (before && Math.abs(x - before[0]) + Math.abs(y - before[1]) < 1 && frame < show.frame) continue;
        if (before) pen.lineTo(x, y);
        else pen.moveTo(x, y);
        before = [x, y];
      }
    }
    pen.stroke();
  }

  collectWays() {
    const { body } = this;
    const at = body.at;
    this.ways = [];
    for (let frame = 0; frame < body.frames.ready; frame++) {
      body.go(frame);
      const way = new Float64Array(2 * body.count);
      for (let i = 0; i < body.count; i++) way.set([body.dx[i], body.dy[i]], 2 * i);
      this.ways.push(way);
    }
    body.go(at);
  }

  drawOver() {
    const isEmpty = this.kept < 0 && this.marked < 0 && !shown.over && !(this.show.layers.cracks && this.body.brokenBonds());
    if (isEmpty && this.isClear && this.over.width === this.clearWidth) return;
    [this.isClear, this.clearWidth] = [isEmpty, this.over.width];
    const pen = this.pen(this.over);
    this.paintOver(pen);
    shown.over?.(this);
  }

  paintOver(pen) {
    if (this.show.layers.cracks) this.drawCracks(pen);
    for (const [particle, width] of [[this.kept, 3], [this.marked, 2]]) {
      if (particle < 0) continue;
      const [x, y] = this.at(particle);
      pen.beginPath();
      pen.arc(x, y, Math.max(this.radii[particle] / this.ratio + 3, 6), 0, 7);
      pen.lineWidth = width;
      pen.strokeStyle = themeText("ink");
      pen.stroke();
    }
  }

  // Both flanks of every broken bond: half a bond from each of its ends, across it; dashed, as in the figures.
  drawCracks(pen) {
    const { body, show } = this;
    const broken = body.brokenBonds();
    if (!broken) return;
    pen.strokeStyle = themeText("crack");
    pen.lineWidth = Math.min(Math.max(0.09 * body.animation.spacing * show.camera.scale, 1), 2.5);
    pen.setLineDash(CRACK_DASH);
    pen.beginPath();
    for (let n = 0; n < broken; n++) {
      const [a, b] = [body.bonds[2 * n], body.bonds[2 * n + 1]];
      const bond = this.shown([(body.X[b] - body.X[a]) / 2, (body.Y[b] - body.Y[a]) / 2]);
      const half = bond.map((part) => part * show.camera.scale);
      for (const [end, sign] of [[a, 1], [b, -1]]) {
        const [x, y] = this.at(end);
        const [mx, my] = [x + sign * half[0], y - sign * half[1]];
        pen.moveTo(mx - half[1] * 0.9, my - half[0] * 0.9);
        pen.lineTo(mx + half[1] * 0.9, my + half[0] * 0.9);
      }
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  // The particle nearest to a point of the box, in CSS pixels; -1 if none is near.
  nearest(px, py) {
    const { camera } = this.show;
    const origin = this.shown(this.origin);
    const scale = camera.scale * this.unit;
    const x = (camera.x - origin[0]) / this.unit + (px - this.width / 2) / scale;
    const y = (camera.y - origin[1]) / this.unit - (py - this.height / 2) / scale;
    let [best, found] = [(REACH / scale) ** 2, -1];
    for (let i = 0; i < this.body.count; i++) {
      const [u, v] = [this.places[2 * i] - x, this.places[2 * i + 1] - y];
      const away = u * u + v * v;
      if (away < best) [best, found] = [away, i];
    }
    return found;
  }

  // Puts a picture in the canvases' place: browsers leave those out on paper.
  fix() {
    this.print = made("img", { alt: this.box.getAttribute("aria-label"), src: this.composed().toDataURL() });
    this.box.append(this.print);
  }

  unfix() {
    this.print?.remove();
  }

  // All three canvases as one.
  composed() {
    const canvas = made("canvas", { width: this.middle.width, height: this.middle.height });
    const pen = canvas.getContext("2d");
    for (const layer of [this.under, this.middle, this.over]) pen.drawImage(layer, 0, 0);
    return canvas;
  }
}
