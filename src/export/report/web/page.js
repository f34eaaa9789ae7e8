// Draws what is shown, and starts.

import { listenToAddress, remember } from "./address.js";
import { fit, isTall, refit, turn, wantedFactor } from "./camera.js";
import { Chart } from "./chart.js";
import { words } from "./colour.js";
import { listenToCompare } from "./compare.js";
import { choose, listenToControls, listenToCopy, listenToKeys, listenToTheme, listenToView, nameControls } from "./controls.js";
import { showKept, tip } from "./numbers.js";
import { Player } from "./player.js";
import { drawScale, quantities, shade } from "./scale.js";
import { bodies, data, element, made, shown, state } from "./shown.js";
import { View } from "./view.js";

let isAsked = false;

// Draws before the next refresh, once however often it is asked for.
export function draw() {
  // For print, the drawing was made before the page took the paper's size.
  if (isAsked || shown.isPrinting) return;
  isAsked = true;
  requestAnimationFrame(() => {
    isAsked = false;
    drawNow();
  });
}

export function drawNow() {
  if (!shown.views.length || !shown.player.ready) return;
  const show = { ...state, shade, isFlat: state.quantity === "role" };
  shown.views.filter((view) => view.isSeen).forEach((view) => view.draw(show));
  drawScale();
  drawClock();
  showKept();
  remember();
  document.body.dataset.drawn = String(Number(document.body.dataset.drawn ?? 0) + 1);
}

function drawClock() {
  const { quantity, unit } = bodies[0].animation.clock;
  const [now, end] = [shown.player.times[shown.player.frame], shown.player.times.at(-1)];
  const time = (value) => (Number.isInteger(value) ? String(value) : words(value));
  const whole = shown.player.isLive ? "" : ` of ${time(end)}`;
  const text = `${quantity} ${time(now)}${whole}${unit ? ` ${unit}` : ""}`;
  element("now").textContent = text;
  element("time").value = String(shown.player.frame);
  element("time").setAttribute("aria-valuetext", text);
  shown.charts.forEach((chart) => chart.go(now));
}

function showFrame(frame) {
  state.frame = frame;
  draw();
}

async function startFilm() {
  for (const body of bodies) await body.open();
  const { animation } = bodies[0];
  shown.player = new Player(animation.times, showFrame);
  element("time").max = String(animation.times.length - 1);
  element("quantity").replaceChildren(...quantities().map(({ key, label }) => made("option", { value: key }, label)));
  shown.views = bodies.map((body) => new View(body, element("views")));
  shown.views.forEach((view) => {
    view.prepare();
    listenToView(view);
    new ResizeObserver(() => (state.isFitted && shown.player.ready && !shown.isPrinting ? refit() : draw())).observe(view.box);
  });
  nameControls();
  listenToControls();
  listenToCompare();
  listenToKeys();
  choose(animation.quantities.some(({ key }) => key === "von_mises") ? "von_mises" : "role");
  const before = bodies.slice(0, -1);
  for (const body of before) await body.frames.load(() => {});
  await bodies.at(-1).frames.load((ready) => {
    const isFirst = shown.player.ready === 0;
    shown.player.ready = ready;
    const part = Math.round((100 * ready) / animation.times.length);
    element("loading").textContent = part < 100 ? `Unpacking: ${part} %.` : "";
    if (isFirst) turn(isTall());
  });
  state.factor = wantedFactor();
  element("magnify").value = String(state.factor);
  if (animation.clock.unit === "%") shown.player.go(shown.player.last);
  fit();
  listenToAddress();
  drawNow();
}

async function start() {
  listenToTheme();
  listenToCopy();
  shown.charts = data.plots.map((plot) => new Chart(plot, element("plots"), { tip, seek: (time) => shown.player?.seek(time) }));
  if (bodies.length) await startFilm();
  document.querySelectorAll("[data-seek]").forEach((button) =>
    button.addEventListener("click", () => {
      shown.player?.seek(Number(button.dataset.seek));
      element("views").scrollIntoView({ block: "nearest" });
    }),
  );
  document.body.dataset.ready = "true";
}

export const started = start().catch((error) => {
  element("loading").textContent = `This page cannot show its animation: ${error.message}.`;
  console.error(error);
});
