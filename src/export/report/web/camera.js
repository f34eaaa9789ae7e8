// The camera, and the factor of the displacements drawn.

import { draw } from "./page.js";
import { sampled } from "./scale.js";
import { bodies, element, shown, state } from "./shown.js";

// The view follows once what moves is nearer to its edge than this part of it.
const NEAR_EDGE = 0.03;

export function fit() {
  const seen = shown.views.filter((one) => one.isSeen);
  const boxes = seen.map((view) => view.bounds(sampled(view.body), state.factor, state.turned));
  const low = [0, 1].map((k) => Math.min(...boxes.map((box) => box.low[k])));
  const high = [0, 1].map((k) => Math.max(...boxes.map((box) => box.high[k])));
  const view = shown.views[0];
  // A lying body needs no high window.
  const wanted = (1.15 * view.box.clientWidth * (high[1] - low[1])) / (high[0] - low[0]) + 60;
  const room = shown.roomFor ? Math.max(shown.roomFor(view), 260) : Math.min(0.66 * window.innerHeight, 640);
  const height = Math.round(Math.min(Math.max(wanted, 260), room));
  if (Number.isFinite(height)) shown.views.forEach(({ box }) => (box.style.height = `${height}px`));
  view.resize();
  const scales = [view.width / (high[0] - low[0]), view.height / (high[1] - low[1])];
  const scale = 0.9 * Math.min(...scales.filter((s) => Number.isFinite(s) && s > 0));
  state.camera = { x: (low[0] + high[0]) / 2, y: (low[1] + high[1]) / 2, scale: Number.isFinite(scale) ? scale : 1 };
  state.isFitted = true;
}

// Keeps what moves on the page, unless the reader has moved the view or holds something in it.
export function follow() {
  const [view] = shown.views;
  if (!state.isFitted || view.box.classList.contains("dragged")) return;
  const { low, high } = view.bounds([state.frame], state.factor, state.turned);
  const { x, y, scale } = state.camera;
  const room = [view.width / scale, view.height / scale];
  const within = room.map((length) => (0.5 - NEAR_EDGE) * length);
  const isNear = [x, y].some((middle, k) => low[k] < middle - within[k] || high[k] > middle + within[k]);
  if (!isNear) return;
  if (room.some((length, k) => high[k] - low[k] > 0.9 * length)) fit();
  else state.camera = { x: (low[0] + high[0]) / 2, y: (low[1] + high[1]) / 2, scale };
}

// Pixels of a unit of length at most: nearer, places cannot be distinguished.
function mostPixels({ x, y }) {
  return 2 ** 44 / Math.max(Math.abs(x), Math.abs(y), bodies[0].animation.spacing || 1e-3);
}

// Takes this camera up, from no nearer than there is anything to be seen.
export function look(camera) {
  state.camera = { ...camera, scale: Math.min(camera.scale, mostPixels(camera)) };
  state.isFitted = false;
}

export function zoom(by, view = shown.views[0], at = [view.width / 2, view.height / 2]) {
  const { camera } = state;
  const [ox, oy] = [at[0] - view.width / 2, view.height / 2 - at[1]];
  const scale = Math.min(camera.scale * by, mostPixels(camera));
  look({ x: camera.x + ox / camera.scale - ox / scale, y: camera.y + oy / camera.scale - oy / scale, scale });
  draw();
}

export function move(dx, dy) {
  const { camera } = state;
  look({ ...camera, x: camera.x - dx / camera.scale, y: camera.y + dy / camera.scale });
  draw();
}

// The factor by which displacements are drawn, so that small ones are seen and, where their size is arbitrary, large ones fit.
export function wantedFactor() {
  const { animation } = bodies[0];
  if (animation.radii.length) return 1;
  let largest = 0;
  const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
  for (const body of bodies) {
    for (const frame of sampled(body)) {
      body.go(frame);
      for (const u of body.field("displacement")) if (u > largest) largest = u;
    }
    for (let i = 0; i < body.count; i++) {
      [body.X[i], body.Y[i]].forEach((value, k) => {
        low[k] = Math.min(low[k], value);
        high[k] = Math.max(high[k], value);
      });
    }
  }
  const part = largest / Math.max(high[0] - low[0], high[1] - low[1]);
  if (!(part > 0) || (part >= 0.02 && (part <= 0.6 || !animation.linear))) return 1;
  const wanted = (part < 0.02 ? 0.08 : 0.3) / part;
  const decade = 10 ** Math.floor(Math.log10(wanted));
  return Number(([5, 2].map((m) => m * decade).find((f) => f <= wanted) ?? decade).toPrecision(1));
}

// Whether a body would be a thin upright line on a wide screen.
export function isTall() {
  const { low, high } = shown.views[0].bounds([0], 1, false);
  return bodies[0].animation.radii.length === 0 && high[1] - low[1] > 2.2 * (high[0] - low[0]);
}

export function turn(turned) {
  state.turned = turned;
  element("turn").setAttribute("aria-pressed", String(turned));
  refit();
}

export function refit() {
  fit();
  draw();
}
