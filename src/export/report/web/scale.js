// The colouring of particles: quantities, their range over the animation, the colour bar.

import { SHADES, diverging, palette, themeColour, themeText, ticks, viridis, words } from "./colour.js";
import { bodies, element, made, shown, state } from "./shown.js";
import { markOf } from "./marks.js";
import { isUnit } from "./view.js";

// Values of a quantity that are looked at for the window and for its scale in all frames; of more, these frames are.
const MOST_VALUES = 400000;
const LOOKED_AT = 24;
// The scale ends at this part of all values if the largest is so many times above it; stress has peaks that matter.
const MOST_OF_ALL = 0.995;
const FAR_ABOVE = { von_mises: 6 };
const FAR_ABOVE_OTHERS = 2;
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

// Whether the first body less the second is shown. The error is of both, roles are no numbers.
export function isDifference() {
  return state.compare === "difference" && state.quantity !== "role" && state.quantity !== "error";
}

export function isLog() {
  return state.isLog && !isDifference();
}

// A quantity of a body at its frame, or by how much it is above that of the other body there.
function valuesOf(body, key) {
  if (!isDifference()) return body.field(key);
  const [, other] = bodies;
  other.go(body.at);
  const theirs = other.field(key);
  return body.field(key).map((value, i) => value - theirs[i]);
}

// The frames to look at.
export function sampled({ count: particles }) {
  const { ready, last } = shown.player;
  // While more are still to come, few.
  const isShort = ready > last && ready * particles <= MOST_VALUES;
  const count = isShort ? ready : Math.min(LOOKED_AT, ready);
  const frames = new Set(Array.from({ length: count }, (_, k) => Math.round((k * (ready - 1)) / Math.max(count - 1, 1))));
  if (ready > last) frames.add(last);
  return [...frames];
}

// Lowest and highest value of the scale, and the largest of all.
export function rangeOf(key) {
  const name = isDifference() ? `${key} difference` : key;
  const known = state.ranges.get(name);
  if (known && known.ready === shown.player.ready) return known;
  const values = [];
  let peak = -Infinity;
  for (const body of isDifference() ? bodies.slice(0, 1) : bodies) {
    const at = body.at;
    for (const frame of sampled(body)) {
      body.go(frame);
      const field = valuesOf(body, key);
      const every = Math.max(1, Math.floor(field.length / 4000));
      for (let i = 0; i < field.length; i++) {
        const value = isDifference() ? Math.abs(field[i]) : field[i];
        if (!Number.isFinite(value)) continue;
        if (i % every === 0) values.push(value);
        if (value > peak) peak = value;
      }
    }
    if (at >= 0) body.go(at);
  }
  values.sort((a, b) => a - b);
  const largest = values.length ? peak : 1;
  const most = values[Math.floor(MOST_OF_ALL * (values.length - 1))] ?? 1;
  let high = largest > (FAR_ABOVE[key] ?? FAR_ABOVE_OTHERS) * most && most > 0 ? most : largest;
  let low = Math.min(values[0] ?? 0, 0);
  if (!(high > low)) high = low + 1;
  // Nothing stands in the middle.
  if (isDifference()) low = -high;
  const range = { low, high, largest, ready: shown.player.ready };
  state.ranges.set(name, range);
  return range;
}

export function shade(body, out) {
  if (state.quantity === "role") {
    const roles = body.roles();
    for (let i = 0; i < out.length; i++) out[i] = roles[i] / (SHADES - 1);
    return;
  }
  // The scale first: it looks at other frames.
  const range = rangeOf(state.quantity);
  const { low, high } = range;
  const field = valuesOf(body, state.quantity);
  // A frame that was not looked at may have more.
  for (const value of field) if (Math.abs(value) > range.largest && (isDifference() || value > 0)) range.largest = Math.abs(value);
  if (isLog()) {
    const top = Math.log10(high);
    for (let i = 0; i < out.length; i++) {
      // What is below nothing is at the bottom with nothing.
      const part = 1 + (Math.log10(Math.max(field[i], 0)) - top) / DECADES;
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
      : palette((k) => (isDifference() ? diverging : viridis)(k / (SHADES - 1)));
}

// What the colours mean, as [name, colour, mark] of the roles that there are.
export function roleKeys() {
  const { role_names: names } = bodies[0].animation;
  const counts = names.map(() => 0);
  for (const role of bodies[0].roles()) counts[role] += 1;
  const there = names.map((name, role) => [name, counts[role]]).filter(([, count]) => count > 0);
  return there.map(([name, count]) => [`${count} ${plural(name, count)}`, themeText(name), markOf(name)]);
}

// The key of the bonds that are broken by now; none where there are none.
export function crackKeys() {
  const broken = bodies[0].brokenBonds();
  return broken ? [[`${broken} broken bond${broken === 1 ? "" : "s"}`, themeText("crack"), "crack"]] : [];
}

// The scale of the quantity that is shown: its name, its ends, its ticks as [part of the scale, text], and what is beyond it.
export function scaleOf() {
  const one = quantities().find(({ key }) => key === state.quantity);
  const { low, high, largest } = rangeOf(state.quantity);
  const [first, second] = bodies.map((body) => body.animation.name);
  const label = isDifference() ? `${one.label}, ${first} less ${second}` : one.label;
  const bottom = high / 10 ** DECADES;
  const values = isLog() ? Array.from({ length: DECADES + 1 }, (_, k) => bottom * 10 ** k) : ticks(low, high, 5);
  const part = (value) => (isLog() ? Math.log10(value / bottom) / DECADES : (value - low) / (high - low));
  return {
    name: isUnit(one.unit) ? `${label} [${one.unit}]` : label,
    ends: [low, high],
    ticks: values.map((value) => [part(value), words(value, 3)]),
    more: largest > high ? `brightest up to ${words(largest, 3)}` : "",
  };
}

// The colours of the scale in a row.
export function ramp() {
  const canvas = made("canvas", { width: SHADES, height: 1 });
  canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(state.palette.subarray(0, 4 * SHADES)), SHADES, 1), 0, 0);
  return canvas;
}

// What the scale shows; to lay the page out anew for the same takes longer than a frame may.
let drawn = "";

export function drawScale() {
  const scale = element("scale");
  element("log-label").hidden = state.quantity === "role" || isDifference();
  const isRole = state.quantity === "role";
  const shows = JSON.stringify([isRole ? roleKeys() : scaleOf(), crackKeys(), isDifference(), themeText("card")]);
  if (shows === drawn) return;
  drawn = shows;
  const cracks = crackKeys().map(key);
  if (isRole) {
    scale.replaceChildren(...roleKeys().map(key), ...cracks);
    scale.setAttribute("aria-label", `Colours: ${scale.textContent}`);
    return;
  }
  const { name, ends, ticks: marks, more } = scaleOf();
  const bar = made("div", { class: "ramp" }, ramp());
  for (const [part, text] of marks) {
    const tick = made("span", { class: "tick" }, text);
    tick.style.left = `${100 * part}%`;
    bar.append(tick);
  }
  scale.replaceChildren(made("span", { class: "name" }, name), bar, made("span", {}, more), ...cracks);
  scale.setAttribute("aria-label", `Colours: ${name} from ${words(ends[0], 3)} to ${words(ends[1], 3)}`);
}

export function plural(name, count) {
  return name === "follower" || name === "leader" || name === "ghost" ? (count === 1 ? name : `${name}s`) : name;
}

export function key([text, colour, mark]) {
  const sign = made("i", { class: mark });
  sign.style.setProperty("--own", colour);
  return made("span", { class: "key" }, sign, text);
}
