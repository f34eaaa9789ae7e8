// What is shown, kept in the address of the page: the same address shows the same.

import { look, refit, turn } from "./camera.js";
import { compare, moveEdge } from "./compare.js";
import { choose } from "./controls.js";
import { draw } from "./page.js";
import { quantities } from "./scale.js";
import { data, element, shown, state } from "./shown.js";

// Time without a new picture after which the address is changed, in ms: browsers count changes.
const AFTER = 300;

// What an address says when it says nothing; null until the page has begun.
let plain = null;
let waiting = 0;

function present() {
  const { camera } = state;
  const [view] = shown.views;
  const layers = Object.keys(state.layers).filter((name) => state.layers[name]);
  return {
    at: String(shown.player.times[shown.player.frame]),
    colour: state.quantity,
    log: state.isLog ? "1" : "0",
    enlarged: String(state.factor),
    turned: state.turned ? "1" : "0",
    layers: layers.join(","),
    compare: state.compare,
    edge: element("edge").value,
    // In lengths, which are the same in every window: middle and width.
    view: state.isFitted ? "" : [camera.x, camera.y, view.width / camera.scale].map((value) => Number(value.toPrecision(15))).join(","),
  };
}

// Once the page shows what it shows by itself.
export function listenToAddress() {
  if (data.live) return;
  plain = present();
  recall();
  window.addEventListener("hashchange", recall);
}

// After each picture.
export function remember() {
  if (!plain) return;
  clearTimeout(waiting);
  waiting = setTimeout(() => {
    const changed = Object.entries(present()).filter(([name, value]) => value !== plain[name]);
    // Layers go with the colour until they are chosen.
    const kept = changed.filter(([name]) => name !== "layers" || state.hasChosenLayers);
    const hash = kept.length ? `#${new URLSearchParams(kept)}` : "";
    if (hash === location.hash) return;
    try {
      history.replaceState(null, "", hash || location.pathname + location.search);
    } catch {
      // A page without an address of its own, as in a frame of another, is not remembered.
    }
  }, AFTER);
}

// Takes from the address what makes sense.
function recall() {
  const asked = { ...plain, ...Object.fromEntries(new URLSearchParams(location.hash.slice(1))) };
  compare(asked.compare);
  moveEdge(Number(asked.edge));
  if (quantities().some(({ key }) => key === asked.colour)) choose(asked.colour);
  element("log").checked = state.isLog = asked.log === "1";
  if (asked.layers !== plain.layers) showLayers(asked.layers.split(","));
  const factor = Number(asked.enlarged);
  if (Number.isFinite(factor) && factor >= 0) element("magnify").value = String((state.factor = factor));
  if (asked.at.trim() && Number.isFinite(Number(asked.at))) shown.player.seek(Number(asked.at));
  turn(asked.turned === "1");
  const [x, y, width] = asked.view.split(",").map(Number);
  if (asked.view && [x, y, width].every(Number.isFinite) && width > 0) {
    look({ x, y, scale: shown.views[0].width / width });
  } else refit();
  draw();
}

function showLayers(names) {
  state.hasChosenLayers = true;
  for (const name of Object.keys(state.layers)) {
    element(`layer-${name}`).checked = state.layers[name] = names.includes(name);
  }
}
