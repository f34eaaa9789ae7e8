// Two bodies: beside each other, the second laid over the first up to an edge, or the first less the second.

import { refit } from "./camera.js";
import { takePalette } from "./scale.js";
import { bodies, element, shown, state } from "./shown.js";

const WAYS = ["side", "slider", "difference"];

export function listenToCompare() {
  element("compare-label").hidden = bodies.length !== 2;
  element("compare").addEventListener("change", () => compare(element("compare").value));
  element("edge").addEventListener("input", () => moveEdge(element("edge").valueAsNumber));
}

export function compare(way) {
  if (bodies.length !== 2 || !WAYS.includes(way)) return;
  state.compare = way;
  element("compare").value = way;
  element("views").className = way;
  element("edge").hidden = way !== "slider";
  const [first, second] = bodies.map((body) => body.animation.name);
  const caption = shown.views[0].box.parentElement.querySelector("figcaption");
  if (caption) caption.textContent = way === "difference" ? `${first} less ${second}` : first;
  takePalette();
  refit();
}

// The part of the width up to which the first body is seen, in hundredths.
export function moveEdge(edge) {
  if (!(edge >= 0 && edge <= 100)) return;
  element("edge").value = String(edge);
  element("views").style.setProperty("--edge", String(edge / 100));
}
