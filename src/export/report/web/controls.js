// The reader's controls: pointer, keys, buttons, layers, theme.

import { move, refit, turn, zoom } from "./camera.js";
import { keep, showTip, tip } from "./numbers.js";
import { draw, drawNow } from "./page.js";
import { saveDrawing, savePicture, sharply } from "./picture.js";
import { takePalette } from "./scale.js";
import { bodies, element, made, shown, state } from "./shown.js";

// More particles than this are shown as a surface even by role: dots would be one blot.
const MOST_DOTS = 12000;

export function listenToView(view) {
  const { box } = view;
  // Where each finger, or the mouse, was last.
  const pointers = new Map();
  let moved = 0;
  // What a live page has the pointer do instead of moving the view.
  let tool = null;
  const local = (event) => {
    const bounds = box.getBoundingClientRect();
    return [event.clientX - bounds.left, event.clientY - bounds.top];
  };
  box.addEventListener("pointerdown", (event) => {
    if (!pointers.size) {
      moved = 0;
      tool = shown.tool?.(view, local(event), event) ?? null;
    }
    pointers.set(event.pointerId, local(event));
    box.setPointerCapture(event.pointerId);
    box.classList.add("dragged");
  });
  box.addEventListener("pointermove", (event) => {
    if (!shown.player.ready) return;
    const [now, before] = [local(event), pointers.get(event.pointerId)];
    if (!before) return showTip(view, view.nearest(...now), event);
    pointers.set(event.pointerId, now);
    const by = [now[0] - before[0], now[1] - before[1]];
    moved += Math.abs(by[0]) + Math.abs(by[1]);
    tip(null);
    if (tool) tool.move(now);
    else if (pointers.size > 1) pinch(view, now, before, [...pointers].find(([id]) => id !== event.pointerId)[1]);
    // One finger scrolls the page unless the view is zoomed.
    else if (event.pointerType !== "touch" || !state.isFitted) move(...by);
  });
  const end = (event) => {
    if (tool && pointers.has(event.pointerId)) tool.end(local(event), event);
    pointers.delete(event.pointerId);
    if (pointers.size) return;
    tool = null;
    box.classList.remove("dragged");
  };
  box.addEventListener("pointerup", (event) => {
    if (pointers.size === 1 && pointers.has(event.pointerId) && moved < 4 && shown.player.ready) keep(view, view.nearest(...local(event)));
    end(event);
  });
  box.addEventListener("pointercancel", end);
  box.addEventListener("pointerleave", () => shown.player.ready && showTip(view, -1, null));
  box.addEventListener("dblclick", refit);
  box.addEventListener("wheel", (event) => {
    // Over a view that shows all there is the wheel scrolls the page.
    if (state.isFitted && !event.ctrlKey && !event.metaKey && !shown.tool) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0016)), view, local(event));
  }, { passive: false });
}

// Zooms by what a finger moves away from another one that rests.
function pinch(view, now, before, other) {
  const away = ([x, y]) => Math.max(Math.hypot(x - other[0], y - other[1]), 1);
  zoom(away(now) / away(before), view, [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2]);
}

export function listenToKeys() {
  document.addEventListener("keydown", (event) => {
    const own = event.target.closest("input, select, textarea, button, summary, pre");
    const isRange = event.target.matches?.("#time, input[type=checkbox]");
    // A space would choose what is chosen already.
    const isIdle = event.key === " " && event.target.matches?.("input[type=radio]:checked");
    if ((own && !isRange && !isIdle) || event.ctrlKey || event.metaKey || event.altKey) return;
    const shifts = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };
    const keys = {
      " ": () => shown.player.toggle(),
      ArrowLeft: () => step(-1),
      ArrowRight: () => step(1),
      Home: () => jump(0),
      End: () => jump(shown.player.last),
      "+": () => zoom(1.25),
      "=": () => zoom(1.25),
      "-": () => zoom(0.8),
      0: refit,
    };
    const act = event.shiftKey && shifts[event.key] ? () => move(...shifts[event.key]) : (keys[event.key] ?? shown.keys?.[event.key]);
    if (!act || (isRange && event.target.type === "checkbox" && event.key === " ")) return;
    event.preventDefault();
    act();
  });
  // A button that the mouse has pressed leaves the keys to the page; one that was reached by keys keeps them.
  document.addEventListener("click", ({ detail }) => {
    const leave = ({ activeElement }) => activeElement?.matches("button, input[type=radio], input[type=checkbox]") && activeElement.blur();
    // A label hands its click on first.
    if (detail > 0) setTimeout(leave, 0, document);
  });
}

export function step(by) {
  shown.player.pause();
  shown.player.go(shown.player.frame + by);
}

export function jump(frame) {
  shown.player.pause();
  shown.player.go(frame);
}

export function listenToControls() {
  const on = (id, kind, act) => element(id).addEventListener(kind, act);
  on("play", "click", () => shown.player.toggle());
  on("first", "click", () => jump(0));
  on("last", "click", () => jump(shown.player.last));
  on("back", "click", () => step(-1));
  on("forth", "click", () => step(1));
  on("time", "input", () => jump(Number(element("time").value)));
  on("speed", "change", () => (shown.player.speed = Number(element("speed").value)));
  on("zoom-in", "click", () => zoom(1.25));
  on("zoom-out", "click", () => zoom(0.8));
  on("zoom-fit", "click", refit);
  on("turn", "click", () => turn(!state.turned));
  on("picture", "click", savePicture);
  on("drawing", "click", saveDrawing);
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
  on("find", "change", () => shown.views.forEach((view) => keep(view, view.body.find(element("find").value.trim()))));
  for (const name of ["points", "bonds", "surface", "cracks", "ways"]) {
    on(`layer-${name}`, "change", () => {
      state.hasChosenLayers = true;
      state.layers[name] = element(`layer-${name}`).checked;
      draw();
    });
  }
  shown.player.changed = () => {
    element("play-icon").setAttribute("d", shown.player.playing ? "M4 2h2v12H4zM10 2h2v12h-2z" : "M4 2l10 6-10 6z");
    element("play").setAttribute("aria-label", shown.player.playing ? "Pause" : "Play");
  };
}

export function choose(quantity) {
  state.quantity = quantity;
  layersFor(quantity);
  element("quantity").value = quantity;
  takePalette();
  draw();
}

// Until layers are chosen, a field fills the body and roles are dots, as each is read best.
export function layersFor(quantity) {
  if (state.hasChosenLayers) return;
  const { animation, bonds, triangles } = bodies[0];
  const filled = triangles.length > 0 && (quantity !== "role" || animation.count > MOST_DOTS);
  state.layers = {
    points: !filled,
    bonds: bonds.length > 0 && animation.count <= MOST_DOTS && !filled,
    surface: filled,
    cracks: true,
    ways: animation.radii.length > 0,
  };
  for (const [name, on] of Object.entries(state.layers)) element(`layer-${name}`).checked = on;
}

export function nameControls() {
  const { animation } = bodies[0];
  const isSwarm = animation.radii.length > 0;
  const has = { bonds: bodies[0].bonds.length > 0, surface: bodies[0].triangles.length > 0 };
  const offer = (name, is) => (element(`layer-${name}`).closest("label").hidden = !is);
  offer("bonds", has.bonds);
  offer("surface", has.surface);
  offer("cracks", bodies[0].breaks[0] < Infinity);
  offer("ways", isSwarm);
  element("points-name").textContent = `${animation.noun}s`;
  element("bonds-name").textContent = isSwarm ? "links" : "bonds";
  element("find-name").textContent = animation.noun[0].toUpperCase() + animation.noun.slice(1);
  element("noun").textContent = animation.noun;
  element("magnify-label").hidden = isSwarm;
  element("find-names").replaceChildren(...animation.names.map((value) => made("option", { value })));
}

export function listenToCopy() {
  const [button, command] = [element("copy"), element("command")];
  const say = (word) => {
    button.textContent = word;
    setTimeout(() => (button.textContent = "copy"), 2000);
  };
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(command.textContent);
      say("copied");
    } catch {
      // Where a page may not, the reader can.
      window.getSelection().selectAllChildren(command);
      say("selected");
    }
  });
}

export function listenToTheme() {
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
    sharply(() => shown.views.forEach((view) => view.fix()));
    shown.isPrinting = true;
  });
  window.addEventListener("afterprint", () => {
    shown.isPrinting = false;
    shown.views.forEach((view) => view.unfix());
    take(before === "dark");
  });
}
