// The colouring of particles: quantities, their range over the animation, the colour bar.

import { SHADES, palette, themeColour, themeText, ticks, viridis, words } from "./colour.js";
import { bodies, element, shown, state } from "./shown.js";
import { isUnit } from "./view.js";

// Frames looked at for the window and for the scale of a quantity.
const LOOKED_AT = 24;
// The scale ends at this part of all values if the rest is far above it.
const MOST_OF_ALL = 0.995;
// Decades of a logarithmic scale.
const DECADES = 4;

// The quantities that can be chosen: role and displacement always, the others as the animation has them.
export function quantities() {
  const { animation } = bodies[0];
  const own = animation.quantities.map((one) => ({ ...one }));
  return [
    { key: "role", label: "role", unit: "" },
    { key: "displacement", label: "displacement", unit: animation.unit },
    ...own,
  ];
}

export function sampled(ready, last) {
  const count = Math.min(LOOKED_AT, ready);
  const frames = new Set(Array.from({ length: count }, (_, k) => Math.round((k * (ready - 1)) / Math.max(count - 1, 1))));
  if (ready > last) frames.add(last);
  return [...frames];
}

// Lowest and highest value of the scale, and the largest of all.
export function rangeOf(key) {
  const known = state.ranges.get(key);
  if (known && known.ready === shown.player.ready) return known;
  const values = [];
  for (const body of bodies) {
    const at = body.at;
    for (const frame of sampled(shown.player.ready, shown.player.last)) {
      body.go(frame);
      const field = body.field(key);
      const every = Math.max(1, Math.floor(field.length / 4000));
      for (let i = 0; i < field.length; i += every) if (Number.isFinite(field[i])) values.push(field[i]);
    }
    if (at >= 0) body.go(at);
  }
  values.sort((a, b) => a - b);
  const largest = values.at(-1) ?? 1;
  const most = values[Math.floor(MOST_OF_ALL * (values.length - 1))] ?? 1;
  let high = largest > 2 * most && most > 0 ? most : largest;
  const low = Math.min(values[0] ?? 0, 0);
  if (!(high > low)) high = low + 1;
  const range = { low, high, largest, ready: shown.player.ready };
  state.ranges.set(key, range);
  return range;
}

export function shade(body, out) {
  if (state.quantity === "role") {
    const roles = body.roles();
    for (let i = 0; i < out.length; i++) out[i] = roles[i] / (SHADES - 1);
    return;
  }
  // The scale first: it looks at other frames.
  const { low, high } = rangeOf(state.quantity);
  const field = body.field(state.quantity);
  if (state.isLog) {
    const top = Math.log10(high);
    for (let i = 0; i < out.length; i++) {
      const part = 1 + (Math.log10(Math.abs(field[i])) - top) / DECADES;
      out[i] = Number.isNaN(part) ? -1 : Math.min(Math.max(part, 0), 1);
    }
  } else {
    const width = high - low;
    for (let i = 0; i < out.length; i++) {
      const part = (field[i] - low) / width;
      out[i] = Number.isNaN(part) ? -1 : Math.min(Math.max(part, 0), 1);
    }
  }
}

export function takePalette() {
  const roles = bodies[0].animation.role_names.map((name) => themeColour(name));
  state.palette =
    state.quantity === "role"
      ? palette((k) => roles[k] ?? [0, 0, 0])
      : palette((k) => viridis(k / (SHADES - 1)));
}

export function drawScale() {
  const scale = element("scale");
  const one = quantities().find(({ key }) => key === state.quantity);
  element("log-label").hidden = state.quantity === "role";
  if (state.quantity === "role") {
    const { role_names: names } = bodies[0].animation;
    const counts = names.map(() => 0);
    for (const role of bodies[0].roles()) counts[role] += 1;
    const keys = names.map((name, role) => (counts[role] ? key(themeText(name), `${counts[role]} ${plural(name, counts[role])}`) : null));
    if (bodies[0].brokenBonds()) keys.push(key(themeText("crack"), `${bodies[0].brokenBonds()} broken bonds`));
    scale.replaceChildren(...keys.filter(Boolean));
    scale.setAttribute("aria-label", `Colours: ${scale.textContent}`);
    return;
  }
  const { low, high, largest } = rangeOf(state.quantity);
  const name = Object.assign(document.createElement("span"), { className: "name" });
  name.textContent = isUnit(one.unit) ? `${one.label} [${one.unit}]` : one.label;
  const ramp = Object.assign(document.createElement("div"), { className: "ramp" });
  const canvas = Object.assign(document.createElement("canvas"), { width: SHADES, height: 1 });
  canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(state.palette.subarray(0, 4 * SHADES)), SHADES, 1), 0, 0);
  ramp.append(canvas);
  const bottom = high / 10 ** DECADES;
  const values = state.isLog ? Array.from({ length: DECADES + 1 }, (_, k) => bottom * 10 ** k) : ticks(low, high, 5);
  for (const value of values) {
    const part = state.isLog ? Math.log10(value / bottom) / DECADES : (value - low) / (high - low);
    const tick = Object.assign(document.createElement("span"), { className: "tick", textContent: words(value, 3) });
    tick.style.left = `${100 * part}%`;
    ramp.append(tick);
  }
  const more = document.createElement("span");
  if (largest > high) more.textContent = `brightest up to ${words(largest, 3)}`;
  scale.replaceChildren(name, ramp, more);
  if (bodies[0].brokenBonds()) scale.append(key(themeText("crack"), `${bodies[0].brokenBonds()} broken bonds`));
  scale.setAttribute("aria-label", `Colours: ${name.textContent} from ${words(low, 3)} to ${words(high, 3)}`);
}

export function plural(name, count) {
  return name === "follower" || name === "leader" || name === "ghost" ? (count === 1 ? name : `${name}s`) : name;
}

export function key(colour, text) {
  const span = Object.assign(document.createElement("span"), { className: "key" });
  const dot = document.createElement("i");
  dot.style.background = colour;
  span.append(dot, text);
  return span;
}
