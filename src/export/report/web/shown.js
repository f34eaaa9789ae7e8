// The state of the page: bodies with their views, charts, the clock, and what was chosen.

import { Body } from "./body.js";

export const element = (id) => document.getElementById(id);

// A new element with these attributes and what stands in it.
export function made(tag, attributes = {}, ...within) {
  const one = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) one.setAttribute(name, value);
  one.append(...within);
  return one;
}

export const data = JSON.parse(element("data").textContent);
export const bodies = data.stages.map((animation, number) => new Body(animation, number));

export const state = {
  frame: 0,
  quantity: "role",
  isLog: false,
  // Of two bodies: beside each other ("side"), the second laid over the first ("slider"), or what lies between them.
  compare: "side",
  factor: 1,
  turned: false,
  camera: { x: 0, y: 0, scale: 1 },
  layers: {},
  ranges: new Map(),
};

// A live page adds what takes the pointer (`tool`), what is drawn on top (`over`), where words are said (`say`), keys of its own
// (`keys`) and how high a view may be (`roomFor`). `sharpness` is in pixels to a CSS pixel, where it is not the screen's.
export const shown = { views: [], charts: [], player: null, isPrinting: false, sharpness: null };

// For the browser's console: `report.bodies[0].numbers(66)`.
window.report = {
  bodies,
  state,
  get views() {
    return shown.views;
  },
  get player() {
    return shown.player;
  },
};
