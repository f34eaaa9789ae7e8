// Charts as SVG: lines and points over two axes, with the animation's clock as a line to drag.

import { logTicks, placeWords, ticks, words } from "./colour.js";
import { made } from "./shown.js";

const HEIGHT = 300;
const ROOM = { top: 10, right: 16, bottom: 42 };
// Points farther from the pointer than this are not named, in pixels.
const NEAR = 24;

function svg(name, attributes, parent) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}

function inkOf(colour) {
  return colour === "ink" || colour === "#444444" ? "var(--ink)" : `color-mix(in srgb, ${colour} var(--keep), white)`;
}

export class Chart {
  // `tip` shows a text at a point of the page, or hides; `seek` takes the animation to a value of its clock.
  constructor(plot, parent, { tip, seek }) {
    Object.assign(this, { plot, tip, seek });
    this.hidden = new Set();
    this.legend = made("div", { class: "legend", role: "group", "aria-label": "Series" });
    this.holder = made("div");
    this.card = made("figure", { class: "card" }, made("h2", {}, plot.title), this.legend, this.holder);
    if (plot.note) this.card.append(made("p", { class: "note" }, plot.note));
    parent.append(this.card);
    this.drawLegend();
    new ResizeObserver(() => this.draw()).observe(this.holder);
  }

  drawLegend() {
    this.plot.series.forEach((series, n) => {
      if (!series.name) return;
      const button = made("button", { type: "button", "aria-pressed": "true", title: "Show or hide" });
      const sample = svg("svg", { viewBox: "0 0 22 12", "aria-hidden": "true" }, button);
      this.drawMark(sample, series, [[2, 6], [20, 6]], [[11, 6]]);
      button.append(series.name);
      button.addEventListener("click", () => {
        const shown = this.hidden.delete(n) || !this.hidden.add(n);
        button.setAttribute("aria-pressed", String(shown));
        this.draw();
      });
      this.legend.append(button);
    });
  }

  // A line through `line`, and marks at `points`, as the series is drawn.
  drawMark(parent, { style, colour }, line, points) {
    const ink = inkOf(colour);
    if (style === "line" || style === "front") {
      // What an axis cannot show, as a logarithmic one zeros, is a gap.
      const isShown = (n) => line[n]?.every(Number.isFinite);
      const part = ([x, y], n) => (isShown(n) ? `${isShown(n - 1) ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}` : "");
      const d = line.map(part).join("");
      svg("path", { d, fill: "none", stroke: ink, "stroke-width": style === "line" ? 1.8 : 1.2, "stroke-linejoin": "round" }, parent);
      // A line of one point would not be seen.
      const isLone = (_, n) => style === "line" && isShown(n) && !isShown(n - 1) && !isShown(n + 1);
      for (const [cx, cy] of line.filter(isLone)) svg("circle", { cx: cx.toFixed(1), cy: cy.toFixed(1), r: 2, fill: ink }, parent);
    }
    if (style === "line") return;
    const radius = { dots: 4, rings: 4, front: 6.5, beads: 6 }[style];
    for (const [x, y] of points) {
      const filled = style === "dots" || style === "beads";
      svg("circle", { cx: x.toFixed(1), cy: y.toFixed(1), r: radius, fill: filled ? ink : "none", stroke: filled && style === "dots" ? "none" : ink, "stroke-width": 1.5 }, parent);
    }
  }

  shown() {
    return this.plot.series.filter((_, n) => !this.hidden.has(n));
  }

  // Lowest and highest value of an axis, as the axis counts.
  range(k) {
    const axis = k === 0 ? this.plot.x : this.plot.y;
    const count = (value) => (axis.log ? Math.log10(value) : value);
    // A line that comes to zero goes on, where the axis of its values has none.
    const points = this.shown().flatMap((series) => series.points.filter((point) => Number.isFinite(point[1 - k])));
    const values = points.map((point) => count(point[k]));
    if (k === 0) values.push(...this.plot.landmarks.map((mark) => count(mark.x)));
    const finite = values.filter(Number.isFinite);
    let [low, high] = finite.reduce(([l, h], v) => [Math.min(l, v), Math.max(h, v)], [Infinity, -Infinity]);
    if (!finite.length) [low, high] = [0, 1];
    if (!(high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high), 1e-300))) {
      const around = axis.log || low === 0 ? 0.5 : 0.5 * Math.abs(low);
      [low, high] = [low - around, high + around];
    }
    const margin = k === 0 && this.plot.follows_clock ? 0 : 0.05 * (high - low);
    return [low - margin, high + margin];
  }

  draw() {
    const width = this.holder.clientWidth;
    if (!width) return;
    const { plot } = this;
    const [xs, ys] = [this.range(0), this.range(1)];
    const marks = (axis, [low, high], most) =>
      axis.log ? logTicks(10 ** low, 10 ** high, most) : ticks(low, high, most);
    const yTicks = marks(plot.y, ys, 6);
    // Ticks that lie near each other take more digits to be distinguished.
    const named = (axis, all) => {
      const step = all[1] - all[0];
      return all.map((value) => [value, axis.log || !(step > 0) ? words(value, 4) : placeWords(value, step)]);
    };
    const yNames = named(plot.y, yTicks);
    const left = Math.max(...yNames.map(([, name]) => name.length), 3) * 7.2 + 30;
    const room = { ...ROOM, left };
    const size = [width - room.left - room.right, HEIGHT - room.top - room.bottom];
    const x = (value) => room.left + (((plot.x.log ? Math.log10(value) : value) - xs[0]) / (xs[1] - xs[0])) * size[0];
    const y = (value) => room.top + (1 - ((plot.y.log ? Math.log10(value) : value) - ys[0]) / (ys[1] - ys[0])) * size[1];
    Object.assign(this, { x, y, xs, ys, room, size });
    const root = svg("svg", { viewBox: `0 0 ${width} ${HEIGHT}`, width, height: HEIGHT, role: "img", "aria-label": this.words() });
    this.drawAxes(root, named(plot.x, marks(plot.x, xs, width / 90)), yNames);
    plot.landmarks.forEach(({ x: at, name }, row) => {
      svg("line", { x1: x(at), x2: x(at), y1: room.top, y2: room.top + size[1], stroke: "var(--soft)", "stroke-dasharray": "5 4" }, root);
      const end = x(at) > room.left + 0.6 * size[0];
      const attributes = { x: x(at) + (end ? -5 : 5), y: room.top + 13 + 15 * row, "text-anchor": end ? "end" : "start", class: "faint name" };
      svg("text", attributes, root).textContent = name;
    });
    for (const series of this.shown()) {
      const places = series.points.map((point) => [x(point[0]), point[1] === null ? NaN : y(point[1])]);
      this.drawMark(root, series, places, places.filter((place) => place.every(Number.isFinite)));
    }
    this.cursor = svg("line", { y1: room.top, y2: room.top + size[1], stroke: "var(--accent)", "stroke-width": 1.5, visibility: "hidden" }, root);
    this.ring = svg("circle", { r: 8, fill: "none", stroke: "var(--ink)", "stroke-width": 2, visibility: "hidden" }, root);
    this.holder.replaceChildren(root);
    // On a narrow page a name may reach beyond the chart, which is known now that it has letters.
    for (const name of root.querySelectorAll(".name")) {
      const box = name.getBBox();
      const by = Math.min(width - 2 - (box.x + box.width), 0) || Math.max(2 - box.x, 0);
      name.setAttribute("x", Number(name.getAttribute("x")) + by);
    }
    this.listen(root);
    if (this.now !== undefined) this.go(this.now);
  }

  words() {
    const { title, x, y, series } = this.plot;
    const names = series.map((one) => one.name).filter(Boolean);
    return `${title}: ${y.quantity} against ${x.quantity}${names.length ? ` of ${names.slice(0, 12).join(", ")}` : ""}`;
  }

  drawAxes(root, xTicks, yTicks) {
    const { plot, x, y, room, size } = this;
    const [right, bottom] = [room.left + size[0], room.top + size[1]];
    for (const [value, name] of yTicks) {
      svg("line", { x1: room.left, x2: right, y1: y(value), y2: y(value), stroke: "var(--grid)" }, root);
      svg("text", { x: room.left - 6, y: y(value) + 4, "text-anchor": "end" }, root).textContent = name;
    }
    for (const [value, name] of xTicks) {
      svg("line", { x1: x(value), x2: x(value), y1: room.top, y2: bottom, stroke: "var(--grid)" }, root);
      svg("text", { x: x(value), y: bottom + 16, "text-anchor": "middle" }, root).textContent = name;
    }
    svg("rect", { x: room.left, y: room.top, width: size[0], height: size[1], fill: "none", stroke: "var(--line)" }, root);
    const named = ({ quantity, unit }) => (unit ? `${quantity} [${unit}]` : quantity);
    svg("text", { x: room.left + size[0] / 2, y: bottom + 35, "text-anchor": "middle", class: "faint" }, root).textContent = named(plot.x);
    const middle = room.top + size[1] / 2;
    const up = { x: 13, y: middle, "text-anchor": "middle", transform: `rotate(-90 13 ${middle})`, class: "faint" };
    svg("text", up, root).textContent = named(plot.y);
  }

  listen(root) {
    const place = (event) => {
      const box = root.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const seek = (event) => {
      if (!this.plot.follows_clock) return;
      const part = (place(event)[0] - this.room.left) / this.size[0];
      this.seek(this.xs[0] + Math.min(Math.max(part, 0), 1) * (this.xs[1] - this.xs[0]));
    };
    root.addEventListener("pointerdown", (event) => {
      root.setPointerCapture(event.pointerId);
      seek(event);
    });
    root.addEventListener("pointermove", (event) => {
      if (event.buttons) seek(event);
      this.point(place(event), event);
    });
    root.addEventListener("pointerleave", () => {
      this.ring.setAttribute("visibility", "hidden");
      this.tip(null);
    });
  }

  // Names the point nearest to the pointer.
  point([px, py], event) {
    let best = { away: NEAR };
    for (const series of this.shown()) {
      series.points.forEach((point, n) => {
        if (point[1] === null) return;
        const [x, y] = [this.x(point[0]), this.y(point[1])];
        const away = Math.hypot(x - px, y - py);
        if (away < best.away) best = { away, x, y, series, point, label: series.labels[n] };
      });
    }
    this.ring.setAttribute("visibility", best.series ? "visible" : "hidden");
    if (!best.series) return this.tip(null);
    this.ring.setAttribute("cx", best.x);
    this.ring.setAttribute("cy", best.y);
    const { x, y } = this.plot;
    const plain = `${best.series.name}\n${x.quantity} ${words(best.point[0])} ${x.unit}\n${y.quantity} ${words(best.point[1])} ${y.unit}`;
    this.tip(event, best.label ?? plain.trim());
  }

  // Puts the clock's line where it belongs.
  go(now) {
    this.now = now;
    if (!this.plot.follows_clock || !this.cursor) return;
    const x = this.x(now);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    this.cursor.setAttribute("visibility", "visible");
  }
}
