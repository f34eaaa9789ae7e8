// The numbers of a particle: beside the pointer, or kept below the animation.

import { placeWords, words } from "./colour.js";
import { draw } from "./page.js";
import { bodies, element, made, shown } from "./shown.js";
import { isUnit } from "./view.js";

export function numbersOf(body, particle) {
  const list = made("dl", { class: "numbers" });
  const row = ([key, label], value, exact) => {
    const number = made("data", { value: exact }, value);
    number.dataset.key = key;
    const pair = made("div", {}, made("dt", {}, label), made("dd", {}, number));
    pair.style.display = "contents";
    list.append(pair);
  };
  const role = body.animation.role_names[body.roles()[particle]];
  row(["role", "role"], role, role);
  for (const { key, label, unit, value } of body.numbers(particle)) {
    const isPlace = key === "x" || key === "y";
    // To a thousandth of what lies between neighbours, and to six digits at least.
    const text = isPlace ? placeWords(value, Math.min(1e-3 * body.animation.spacing, 1e-5 * Math.abs(value))) : words(value);
    row([key, isUnit(unit) ? `${label} [${unit}]` : label], text, Number.isFinite(value) ? String(value) : "");
  }
  return list;
}

export function heading(body, particle) {
  const noun = body.animation.names.length ? "" : `${body.animation.noun} `;
  return made("strong", {}, `${noun}${body.name(particle)}`);
}

export function showTip(view, particle, event) {
  view.marked = particle;
  view.drawOver();
  if (particle < 0) return tip(null);
  tip(event, [heading(view.body, particle), numbersOf(view.body, particle)]);
}

// A text or elements beside the pointer; nothing without an event.
export function tip(event, content) {
  const box = element("tip");
  box.hidden = !event;
  if (!event) return;
  box.replaceChildren(...(Array.isArray(content) ? content : [content]));
  const [width, height] = [box.offsetWidth, box.offsetHeight];
  const x = event.clientX + 16 + width > window.innerWidth ? event.clientX - width - 12 : event.clientX + 16;
  const y = Math.min(event.clientY + 12, window.innerHeight - height - 8);
  Object.assign(box.style, { left: `${Math.max(x, 4)}px`, top: `${Math.max(y, 4)}px` });
}

export function keep(view, particle) {
  shown.views.forEach((other) => (other.kept = other === view || bodies.length > 1 ? particle : -1));
  draw();
}

export function showKept() {
  const box = element("kept");
  const kept = shown.views.filter((view) => view.kept >= 0);
  if (box.hidden && !kept.length) return;
  box.hidden = !kept.length;
  box.replaceChildren(
    ...kept.flatMap((view) => {
      const title = heading(view.body, view.kept);
      if (view.body.animation.name) title.textContent += `, ${view.body.animation.name}`;
      return [title, numbersOf(view.body, view.kept)];
    }),
  );
}
