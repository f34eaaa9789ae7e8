// What the mouse does in a live view: takes particles by the hand, cuts bonds, or looks.

import { bodies, shown, state } from "./shown.js";
import { themeText } from "./colour.js";

// The place under a point of the box, in the body's coordinates.
function placeAt(view, [px, py]) {
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
  const particle = tool === "drag" ? view.nearest(...at) : -1;
  if (particle < 0) return null;
  return hand(view, at, particle, event.shiftKey, ask);
}

function hand(view, at, particle, alone, ask) {
  const from = placeAt(view, at);
  let isHeld = false;
  const move = (to) => {
    const place = placeAt(view, to);
    if (!isHeld) ask({ do: "grab", particle, alone });
    isHeld = true;
    ask({ do: "drag", by: [0, 1].map((k) => (place[k] - from[k]) / (state.factor || 1)) });
  };
  const end = () => {
    if (isHeld) ask({ do: "release" });
    return isHeld;
  };
  return { move, end };
}

function knife(view, at, ask) {
  const from = placeAt(view, at);
  const move = (to) => drawKnife(view, at, to);
  const end = (to) => {
    view.drawOver();
    const far = Math.hypot(to[0] - at[0], to[1] - at[1]);
    if (far < 4) return false;
    if (state.factor !== 1) shown.say("displacements are enlarged: set Enlarged to 1 to cut where bonds are");
    else ask({ do: "cut", from, to: placeAt(view, to) });
    return true;
  };
  return { move, end };
}

function drawKnife(view, from, to) {
  view.isClear = false;
  view.drawOver();
  const pen = view.over.getContext("2d");
  pen.beginPath();
  pen.moveTo(...from);
  pen.lineTo(...to);
  pen.lineWidth = 2;
  pen.strokeStyle = themeText("crack");
  pen.setLineDash([5, 4]);
  pen.stroke();
  pen.setLineDash([]);
  view.isClear = false;
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
