// What the mouse does in a live view: takes particles by the hand, cuts bonds, or looks.

import { bodies, shown, state } from "./shown.js";
import { themeText } from "./colour.js";

// The place under a point of the box, in the body's coordinates.
export function placeAt(view, [px, py]) {
  const { camera } = state;
  const x = camera.x + (px - view.width / 2) / camera.scale;
  const y = camera.y - (py - view.height / 2) / camera.scale;
  return state.turned ? [-y, x] : [x, y];
}

export function toolName() {
  return document.querySelector("input[name=tool]:checked").value;
}

// What takes the pointer from here on, or null where the view is to be moved: `move(at)` and `end(at)`.
export function takeTool(view, at, event, ask) {
  const tool = toolName();
  if (tool === "cut") return knife(view, at, ask);
  const particle = tool === "look" ? -1 : view.nearest(...at);
  if (tool === "load") return particle < 0 ? null : pull(view, at, sideOf(view.body, particle), ask);
  if (tool !== "drag") return null;
  if (particle >= 0) return hand(view, at, { do: "grab", particle, alone: event.shiftKey }, state.factor || 1, ask);
  const obstacle = view.obstacleAt(...at);
  return obstacle < 0 ? null : hand(view, at, { do: "grab-obstacle", obstacle }, 1, ask);
}

// What is shown enlarged by a factor goes less far than the pointer.
function hand(view, at, grab, factor, ask) {
  const from = placeAt(view, at);
  let isHeld = false;
  const move = (to) => {
    const place = placeAt(view, to);
    if (!isHeld) ask(grab);
    isHeld = true;
    ask({ do: "drag", by: [0, 1].map((k) => (place[k] - from[k]) / factor) });
  };
  const end = () => {
    if (isHeld) ask({ do: "release" });
    return isHeld;
  };
  return { move, end };
}

function knife(view, at, ask) {
  const from = placeAt(view, at);
  const move = (to) => drawLine(view, at, to);
  const end = (to) => {
    view.drawOver();
    const far = Math.hypot(to[0] - at[0], to[1] - at[1]);
    if (far < 4) return false;
    if (state.factor !== 1) shown.say("Displacements are enlarged: set Enlarged to 1 to cut where bonds are.", true);
    else ask({ do: "cut", from, to: placeAt(view, to) });
    return true;
  };
  return { move, end };
}

// The side of the body that a particle is nearest to, as the body was at first.
function sideOf({ X, Y }, particle) {
  const ends = (values) => values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
  const [[left, right], [bottom, top]] = [ends(X), ends(Y)];
  const away = { left: X[particle] - left, right: right - X[particle], bottom: Y[particle] - bottom, top: top - Y[particle] };
  return Object.entries(away).reduce((nearest, one) => (one[1] < nearest[1] ? one : nearest))[0];
}

function pull(view, at, side, ask) {
  const from = placeAt(view, at);
  const move = (to) => drawLine(view, at, to);
  const end = (to) => {
    view.drawOver();
    const place = placeAt(view, to);
    if (Math.hypot(to[0] - at[0], to[1] - at[1]) < 4) return false;
    ask({ do: "load", side, by: [0, 1].map((k) => (place[k] - from[k]) / (state.factor || 1)) });
    shown.say(`The ${side} side is loaded: drag it again for another load, undo takes it away.`);
    return true;
  };
  return { move, end };
}

export function drawLine(view, from, to) {
  view.isClear = false;
  view.drawOver();
  drawDashes(view, from, to);
  view.isClear = false;
}

export function drawDashes(view, from, to) {
  const pen = view.over.getContext("2d");
  pen.beginPath();
  pen.moveTo(...from);
  pen.lineTo(...to);
  pen.lineWidth = 2;
  pen.strokeStyle = themeText("crack");
  pen.setLineDash([5, 4]);
  pen.stroke();
  pen.setLineDash([]);
}

// Drags a leader of a node: where it is let go, `send(by)` sends the formation, and not before. `mark(from, to)` marks the way.
export function takeFormation(view, at, mark, send) {
  const { firstRoles, animation } = view.body;
  const particle = toolName() === "drag" ? view.nearest(...at) : -1;
  if (particle < 0 || animation.role_names[firstRoles[particle]] !== "leader") return null;
  const from = placeAt(view, at);
  const move = (to) => mark(at, to);
  const end = (to, event) => {
    mark();
    if (event.type !== "pointerup" || Math.hypot(to[0] - at[0], to[1] - at[1]) < 4) return false;
    const place = placeAt(view, to);
    send([0, 1].map((k) => (place[k] - from[k]) / (state.factor || 1)));
    return true;
  };
  return { move, end };
}

// Lines from robots to their targets.
export function drawTargets(view) {
  const { body, show } = view;
  const [tx, ty] = ["target_dx", "target_dy"].map((name) => body.frames.values.get(name));
  if (!tx || !ty) return;
  const pen = view.over.getContext("2d");
  pen.lineWidth = 1;
  pen.strokeStyle = themeText("ink");
  pen.beginPath();
  for (let i = 0; i < body.count; i++) {
    if (!Number.isFinite(tx[i] + ty[i])) continue;
    const [x, y] = view.at(i);
    const [u, v] = view.place([body.X[i] + show.factor * tx[i], body.Y[i] + show.factor * ty[i]]);
    if (Math.hypot(u - x, v - y) < 2) continue;
    pen.moveTo(x, y);
    pen.lineTo(u, v);
    pen.moveTo(u - 3, v - 3);
    pen.lineTo(u + 3, v + 3);
    pen.moveTo(u - 3, v + 3);
    pen.lineTo(u + 3, v - 3);
  }
  pen.stroke();
}

// Rings around robots that break a bound, and crosses on those that have a fault.
export function drawAlarms(view, { alarmed, faults }) {
  const pen = view.over.getContext("2d");
  pen.lineWidth = 3;
  pen.strokeStyle = themeText("crack");
  for (const robot of alarmed.filter((one) => one < bodies[0].count)) {
    const [x, y] = view.at(robot);
    pen.beginPath();
    pen.arc(x, y, Math.max(view.radii[robot] / view.ratio + 5, 9), 0, 7);
    pen.stroke();
  }
  pen.strokeStyle = themeText("ink");
  for (const [robot, kind] of faults) {
    const [x, y] = view.at(robot);
    const r = Math.max(view.radii[robot] / view.ratio, 5);
    pen.beginPath();
    pen.moveTo(x - r, y - r);
    pen.lineTo(x + r, y + r);
    pen.moveTo(x - r, y + r);
    pen.lineTo(x + r, y - r);
    pen.stroke();
    pen.fillStyle = themeText("ink");
    pen.font = "11px system-ui, sans-serif";
    pen.fillText(kind, x + r + 3, y - r);
  }
}
