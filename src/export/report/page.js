// Puts body, views, charts and controls together.

import { SHADES, palette, themeColour, themeText, ticks, viridis, words } from "./colour.js";
import { Body } from "./body.js";
import { View, isUnit } from "./view.js";
import { Chart } from "./chart.js";
import { Player } from "./player.js";

const element = (id) => document.getElementById(id);
const data = JSON.parse(element("data").textContent);

// Frames looked at for the window and for the scale of a quantity.
const LOOKED_AT = 24;
// The scale ends at this part of all values if the rest is far above it.
const MOST_OF_ALL = 0.995;
// Decades of a logarithmic scale.
const DECADES = 4;
// More particles than this are shown as a surface even by role: dots would be one blot.
const MOST_DOTS = 12000;

const state = {
  frame: 0,
  quantity: "role",
  isLog: false,
  factor: 1,
  turned: false,
  camera: { x: 0, y: 0, scale: 1 },
  layers: {},
  ranges: new Map(),
};
const bodies = data.stages.map((film, number) => new Body(film, number));
let views = [];
let charts = [];
let player = null;

// For the browser's console: `report.bodies[0].numbers(66)`.
window.report = { bodies, state, get views() { return views; }, get player() { return player; } };

// ---- colours ----

// The quantities that can be chosen: role and displacement always, the others as the film has them.
function quantities() {
  const { film } = bodies[0];
  const own = film.quantities.map((one) => ({ ...one }));
  return [
    { key: "role", label: "role", unit: "" },
    { key: "displacement", label: "displacement", unit: film.unit },
    ...own,
  ];
}

function sampled(ready, last) {
  const count = Math.min(LOOKED_AT, ready);
  const frames = new Set(Array.from({ length: count }, (_, k) => Math.round((k * (ready - 1)) / Math.max(count - 1, 1))));
  if (ready > last) frames.add(last);
  return [...frames];
}

// Lowest and highest value of the scale, and the largest of all.
function rangeOf(key) {
  const known = state.ranges.get(key);
  if (known && known.ready === player.ready) return known;
  const values = [];
  for (const body of bodies) {
    const at = body.at;
    for (const frame of sampled(player.ready, player.last)) {
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
  const range = { low, high, largest, ready: player.ready };
  state.ranges.set(key, range);
  return range;
}

function shade(body, out) {
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

function takePalette() {
  const roles = bodies[0].film.role_names.map((name) => themeColour(name));
  state.palette =
    state.quantity === "role"
      ? palette((k) => roles[k] ?? [0, 0, 0])
      : palette((k) => viridis(k / (SHADES - 1)));
}

function drawScale() {
  const scale = element("scale");
  const one = quantities().find(({ key }) => key === state.quantity);
  element("log-label").hidden = state.quantity === "role";
  if (state.quantity === "role") {
    const { role_names: names } = bodies[0].film;
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

function plural(name, count) {
  return name === "follower" || name === "leader" || name === "ghost" ? (count === 1 ? name : `${name}s`) : name;
}

function key(colour, text) {
  const span = Object.assign(document.createElement("span"), { className: "key" });
  const dot = document.createElement("i");
  dot.style.background = colour;
  span.append(dot, text);
  return span;
}

// ---- camera ----

function fit() {
  const boxes = views.map((view) => view.bounds(sampled(player.ready, player.last), state.factor, state.turned));
  const low = [0, 1].map((k) => Math.min(...boxes.map((box) => box.low[k])));
  const high = [0, 1].map((k) => Math.max(...boxes.map((box) => box.high[k])));
  const view = views[0];
  // A lying body needs no high window.
  const wanted = (1.15 * view.box.clientWidth * (high[1] - low[1])) / (high[0] - low[0]) + 60;
  const height = Math.round(Math.min(Math.max(wanted, 260), Math.min(0.66 * window.innerHeight, 640)));
  if (Number.isFinite(height)) views.forEach(({ box }) => (box.style.height = `${height}px`));
  view.resize();
  const scales = [view.width / (high[0] - low[0]), view.height / (high[1] - low[1])];
  const scale = 0.9 * Math.min(...scales.filter((s) => Number.isFinite(s) && s > 0));
  state.camera = { x: (low[0] + high[0]) / 2, y: (low[1] + high[1]) / 2, scale: Number.isFinite(scale) ? scale : 1 };
  state.isFitted = true;
}

function zoom(by, view = views[0], at = [view.width / 2, view.height / 2]) {
  const { camera } = state;
  const [ox, oy] = [at[0] - view.width / 2, view.height / 2 - at[1]];
  const scale = camera.scale * by;
  state.camera = { x: camera.x + ox / camera.scale - ox / scale, y: camera.y + oy / camera.scale - oy / scale, scale };
  state.isFitted = false;
  draw();
}

function move(dx, dy) {
  const { camera } = state;
  state.camera = { ...camera, x: camera.x - dx / camera.scale, y: camera.y + dy / camera.scale };
  state.isFitted = false;
  draw();
}

// Times what displacements are drawn, so that small ones are seen and, where their size is arbitrary, large ones fit.
function wantedFactor() {
  const { film } = bodies[0];
  if (film.radii.length) return 1;
  let largest = 0;
  const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
  for (const body of bodies) {
    for (const frame of sampled(player.ready, player.last)) {
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
  if (!(part > 0) || (part >= 0.02 && (part <= 0.6 || !film.linear))) return 1;
  const wanted = (part < 0.02 ? 0.08 : 0.3) / part;
  const decade = 10 ** Math.floor(Math.log10(wanted));
  return Number(([5, 2].map((m) => m * decade).find((f) => f <= wanted) ?? decade).toPrecision(1));
}

// ---- drawing ----

let isAsked = false;
let isPrinting = false;

// Draws before the next refresh, once however often it is asked for.
function draw() {
  // What is printed was drawn before the page took the paper's size.
  if (isAsked || isPrinting) return;
  isAsked = true;
  requestAnimationFrame(() => {
    isAsked = false;
    drawNow();
  });
}

function drawNow() {
  if (!views.length || !player.ready) return;
  const show = { ...state, shade, isFlat: state.quantity === "role" };
  views.forEach((view) => view.draw(show));
  drawScale();
  drawClock();
  showKept();
  document.body.dataset.drawn = String(Number(document.body.dataset.drawn ?? 0) + 1);
}

function drawClock() {
  const { quantity, unit } = bodies[0].film.clock;
  const [now, end] = [player.times[player.frame], player.times.at(-1)];
  const text = `${quantity} ${words(now)} of ${words(end)}${unit ? ` ${unit}` : ""}`;
  element("now").textContent = text;
  element("time").value = String(player.frame);
  element("time").setAttribute("aria-valuetext", text);
  charts.forEach((chart) => chart.go(now));
}

function showFrame(frame) {
  state.frame = frame;
  draw();
}

// ---- numbers of a particle ----

function numbersOf(body, particle) {
  const list = document.createElement("dl");
  list.className = "numbers";
  const row = (label, value, exact) => {
    const pair = document.createElement("div");
    pair.style.display = "contents";
    const number = Object.assign(document.createElement("data"), { value: exact, textContent: value });
    number.dataset.key = label[0];
    const dd = document.createElement("dd");
    dd.append(number);
    pair.append(Object.assign(document.createElement("dt"), { textContent: label[1] }), dd);
    list.append(pair);
  };
  const role = body.film.role_names[body.roles()[particle]];
  row(["role", "role"], role, role);
  for (const { key, label, unit, value } of body.numbers(particle)) {
    row([key, isUnit(unit) ? `${label} [${unit}]` : label], words(value), Number.isFinite(value) ? String(value) : "");
  }
  return list;
}

function heading(body, particle) {
  const noun = body.film.names.length ? "" : `${body.film.noun} `;
  return Object.assign(document.createElement("strong"), { textContent: `${noun}${body.name(particle)}` });
}

function showTip(view, particle, event) {
  view.marked = particle;
  view.drawOver();
  if (particle < 0) return tip(null);
  tip(event, [heading(view.body, particle), numbersOf(view.body, particle)]);
}

// A text or elements beside the pointer; nothing without an event.
function tip(event, content) {
  const box = element("tip");
  box.hidden = !event;
  if (!event) return;
  box.replaceChildren(...(Array.isArray(content) ? content : [content]));
  const [width, height] = [box.offsetWidth, box.offsetHeight];
  const x = event.clientX + 16 + width > window.innerWidth ? event.clientX - width - 12 : event.clientX + 16;
  const y = Math.min(event.clientY + 12, window.innerHeight - height - 8);
  Object.assign(box.style, { left: `${Math.max(x, 4)}px`, top: `${Math.max(y, 4)}px` });
}

function keep(view, particle) {
  views.forEach((other) => (other.kept = other === view || bodies.length > 1 ? particle : -1));
  draw();
}

function showKept() {
  const box = element("kept");
  const shown = views.filter((view) => view.kept >= 0);
  box.hidden = !shown.length;
  box.replaceChildren(
    ...shown.flatMap((view) => {
      const title = heading(view.body, view.kept);
      if (view.body.film.name) title.textContent += `, ${view.body.film.name}`;
      return [title, numbersOf(view.body, view.kept)];
    }),
  );
}

// ---- controls ----

function listenToView(view) {
  const { box } = view;
  let from = null;
  let moved = 0;
  const local = (event) => {
    const bounds = box.getBoundingClientRect();
    return [event.clientX - bounds.left, event.clientY - bounds.top];
  };
  box.addEventListener("pointerdown", (event) => {
    from = [event.clientX, event.clientY];
    moved = 0;
    box.setPointerCapture(event.pointerId);
    box.classList.add("dragged");
  });
  box.addEventListener("pointermove", (event) => {
    if (!player.ready) return;
    if (!from) return showTip(view, view.nearest(...local(event)), event);
    const by = [event.clientX - from[0], event.clientY - from[1]];
    moved += Math.abs(by[0]) + Math.abs(by[1]);
    from = [event.clientX, event.clientY];
    tip(null);
    move(...by);
  });
  const end = () => {
    from = null;
    box.classList.remove("dragged");
  };
  box.addEventListener("pointerup", (event) => {
    if (from && moved < 4 && player.ready) keep(view, view.nearest(...local(event)));
    end();
  });
  box.addEventListener("pointercancel", end);
  box.addEventListener("pointerleave", () => player.ready && showTip(view, -1, null));
  box.addEventListener("dblclick", refit);
  box.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0016)), view, local(event));
  }, { passive: false });
}

function turn(turned) {
  state.turned = turned;
  element("turn").setAttribute("aria-pressed", String(turned));
  refit();
}

function refit() {
  fit();
  draw();
}

function listenToKeys() {
  document.addEventListener("keydown", (event) => {
    const own = event.target.closest("input, select, textarea, button, summary, pre");
    const isRange = event.target.matches?.("input[type=range], input[type=checkbox]");
    if ((own && !isRange) || event.ctrlKey || event.metaKey || event.altKey) return;
    const shifts = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };
    const keys = {
      " ": () => player.toggle(),
      ArrowLeft: () => step(-1),
      ArrowRight: () => step(1),
      Home: () => jump(0),
      End: () => jump(player.last),
      "+": () => zoom(1.25),
      "=": () => zoom(1.25),
      "-": () => zoom(0.8),
      0: refit,
    };
    const act = event.shiftKey && shifts[event.key] ? () => move(...shifts[event.key]) : keys[event.key];
    if (!act || (isRange && event.target.type === "checkbox" && event.key === " ")) return;
    event.preventDefault();
    act();
  });
}

function step(by) {
  player.pause();
  player.go(player.frame + by);
}

function jump(frame) {
  player.pause();
  player.go(frame);
}

function listenToControls() {
  const on = (id, kind, act) => element(id).addEventListener(kind, act);
  on("play", "click", () => player.toggle());
  on("first", "click", () => jump(0));
  on("last", "click", () => jump(player.last));
  on("back", "click", () => step(-1));
  on("forth", "click", () => step(1));
  on("time", "input", () => jump(Number(element("time").value)));
  on("speed", "change", () => (player.speed = Number(element("speed").value)));
  on("zoom-in", "click", () => zoom(1.25));
  on("zoom-out", "click", () => zoom(0.8));
  on("zoom-fit", "click", refit);
  on("turn", "click", () => turn(!state.turned));
  on("picture", "click", savePicture);
  on("quantity", "change", () => choose(element("quantity").value));
  on("log", "change", () => {
    state.isLog = element("log").checked;
    draw();
  });
  on("magnify", "change", () => {
    const factor = Number(element("magnify").value);
    if (Number.isFinite(factor) && factor >= 0) state.factor = factor;
    refit();
  });
  on("find", "change", () => views.forEach((view) => keep(view, view.body.find(element("find").value.trim()))));
  for (const name of ["points", "bonds", "surface", "cracks", "ways"]) {
    on(`layer-${name}`, "change", () => {
      state.hasChosenLayers = true;
      state.layers[name] = element(`layer-${name}`).checked;
      draw();
    });
  }
  player.changed = () => {
    element("play-icon").setAttribute("d", player.playing ? "M4 2h2v12H4zM10 2h2v12h-2z" : "M4 2l10 6-10 6z");
    element("play").setAttribute("aria-label", player.playing ? "Pause" : "Play");
  };
}

function choose(quantity) {
  state.quantity = quantity;
  layersFor(quantity);
  element("quantity").value = quantity;
  takePalette();
  draw();
}

function savePicture() {
  const pictures = views.map((view) => view.composed());
  const gap = 12;
  const canvas = document.createElement("canvas");
  canvas.width = pictures.reduce((sum, one) => sum + one.width + gap, -gap);
  canvas.height = Math.max(...pictures.map((one) => one.height));
  let left = 0;
  for (const one of pictures) {
    canvas.getContext("2d").drawImage(one, left, 0);
    left += one.width + gap;
  }
  const link = document.createElement("a");
  link.href = canvas.toDataURL("image/png");
  link.download = `${document.title} ${element("now").textContent}.png`;
  link.click();
}

// ---- start ----

function listenToTheme() {
  const root = document.documentElement;
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const take = (isDark) => {
    root.dataset.theme = isDark ? "dark" : "light";
    if (bodies.length && state.palette) takePalette();
    draw();
  };
  take(dark.matches);
  dark.addEventListener("change", () => take(dark.matches));
  element("theme").addEventListener("click", () => take(root.dataset.theme !== "dark"));
  // Paper is white.
  let before = "light";
  window.addEventListener("beforeprint", () => {
    before = root.dataset.theme;
    take(false);
    drawNow();
    views.forEach((view) => view.fix());
    isPrinting = true;
  });
  window.addEventListener("afterprint", () => {
    isPrinting = false;
    views.forEach((view) => view.unfix());
    take(before === "dark");
  });
}

// Until somebody chooses layers, a field fills the body and roles are dots: each as it is read best.
function layersFor(quantity) {
  if (state.hasChosenLayers) return;
  const { film, bonds, triangles } = bodies[0];
  const filled = triangles.length > 0 && (quantity !== "role" || film.count > MOST_DOTS);
  state.layers = {
    points: !filled,
    bonds: bonds.length > 0 && film.count <= MOST_DOTS && !filled,
    surface: filled,
    cracks: true,
    ways: film.radii.length > 0,
  };
  for (const [name, on] of Object.entries(state.layers)) element(`layer-${name}`).checked = on;
}

function nameControls() {
  const { film } = bodies[0];
  const isSwarm = film.radii.length > 0;
  const has = { bonds: bodies[0].bonds.length > 0, surface: bodies[0].triangles.length > 0 };
  const offer = (name, is) => (element(`layer-${name}`).closest("label").hidden = !is);
  offer("bonds", has.bonds);
  offer("surface", has.surface);
  offer("cracks", bodies[0].breaks[0] < Infinity);
  offer("ways", isSwarm);
  element("points-name").textContent = `${film.noun}s`;
  element("bonds-name").textContent = isSwarm ? "links" : "bonds";
  element("find-name").textContent = film.noun[0].toUpperCase() + film.noun.slice(1);
  element("magnify-label").hidden = isSwarm;
  element("find-names").replaceChildren(...film.names.map((name) => Object.assign(document.createElement("option"), { value: name })));
}

// Whether a body would be a thin upright line on a wide screen.
function isTall() {
  const { low, high } = views[0].bounds([0], 1, false);
  return bodies[0].film.radii.length === 0 && high[1] - low[1] > 2.2 * (high[0] - low[0]);
}

async function startFilm() {
  for (const body of bodies) await body.open();
  const { film } = bodies[0];
  player = new Player(film.times, showFrame);
  element("time").max = String(film.times.length - 1);
  element("quantity").replaceChildren(
    ...quantities().map(({ key, label }) => Object.assign(document.createElement("option"), { value: key, textContent: label })),
  );
  views = bodies.map((body) => new View(body, element("views")));
  views.forEach((view) => {
    view.prepare();
    listenToView(view);
    new ResizeObserver(() => (state.isFitted && player.ready && !isPrinting ? refit() : draw())).observe(view.box);
  });
  nameControls();
  listenToControls();
  listenToKeys();
  choose(bodies.length > 1 || film.stress ? "von_mises" : "role");
  const before = bodies.slice(0, -1);
  for (const body of before) await body.frames.load(() => {});
  await bodies.at(-1).frames.load((ready) => {
    const isFirst = player.ready === 0;
    player.ready = ready;
    const part = Math.round((100 * ready) / film.times.length);
    element("loading").textContent = part < 100 ? `Unpacking: ${part} %.` : "";
    if (isFirst) turn(isTall());
  });
  state.factor = wantedFactor();
  element("magnify").value = String(state.factor);
  if (film.clock.unit === "%") player.go(player.last);
  fit();
  drawNow();
}

async function start() {
  listenToTheme();
  charts = data.plots.map((plot) => new Chart(plot, element("plots"), { tip, seek: (time) => player?.seek(time) }));
  if (bodies.length) await startFilm();
  document.body.dataset.ready = "true";
}

start().catch((error) => {
  element("loading").textContent = `This page cannot show its film: ${error.message}.`;
  console.error(error);
});
