// The formation of a swarm under a designer's hands: robots placed, moved, linked, named.

import { drawLine, placeAt, toolName } from "./live_tools.js";
import { keep } from "./numbers.js";
import { bodies, data, element, made, shown, state } from "./shown.js";

// Below this the pointer has not moved, in pixels.
const STILL = 4;

const design = { shownFor: null };

export function isDesigning() {
  return toolName() === "place" || toolName() === "link";
}

function far(at, to) {
  return Math.hypot(to[0] - at[0], to[1] - at[1]) >= STILL;
}

// What takes the pointer from here on: `move(at)` and `end(at, event)`.
export function takeDesign(view, at, ask) {
  const robot = view.nearest(...at);
  const edit = (what) => ask({ do: "design", edit: what });
  const onEnd = (act) => (to, event) => {
    view.drawOver();
    if (event.type === "pointerup") act(to);
  };
  if (toolName() === "link") {
    const link = (to) => {
      const other = view.nearest(...to);
      if (far(at, to) && other >= 0 && other !== robot) edit({ what: "link", robots: [robot, other] });
    };
    return robot < 0 ? null : { move: (to) => drawLine(view, at, to), end: onEnd(link) };
  }
  if (robot < 0) {
    const place = (to) => !far(at, to) && edit({ what: "place", at: placeAt(view, to), leads: element("design-leads").checked });
    return { move() {}, end: onEnd(place) };
  }
  const from = placeAt(view, at);
  const shift = (to) => {
    const place = placeAt(view, to);
    if (far(at, to)) edit({ what: "move", robot, by: [0, 1].map((k) => place[k] - from[k]) });
  };
  return { move: (to) => drawLine(view, at, to), end: onEnd(shift) };
}

// The panel beside the tools follows the robot that is kept.
export function showDesign() {
  if (!data.live.design) return;
  const { kept, body } = shown.views[0];
  const now = isDesigning() ? kept : null;
  if (now === design.shownFor) return;
  design.shownFor = now;
  element("live-design").hidden = now === null;
  element("design-robot").hidden = now === null || kept < 0;
  if (now === null || kept < 0) return;
  element("design-name").elements.name.value = body.name(kept);
  element("design-lead").textContent = leads(body, kept) ? "let it follow" : "let it lead";
}

function leads(body, robot) {
  return body.animation.role_names[body.firstRoles[robot]] === "leader";
}

export function listenToDesign(ask, isAtStart) {
  for (const tool of document.querySelectorAll("input[name=tool]")) {
    tool.addEventListener("change", () => {
      if (isDesigning()) {
        if (!state.layers.bonds) element("layer-bonds").click();
        // Robots that have flown stand elsewhere than in the formation.
        if (!isAtStart()) ask({ do: "reset" });
      }
      showDesign();
    });
  }
  const edit = (what, more) => ask({ do: "design", edit: { what, robot: shown.views[0].kept, ...more } });
  element("design-name").addEventListener("submit", (event) => {
    event.preventDefault();
    edit("rename", { name: element("design-name").elements.name.value.trim() });
  });
  element("design-lead").addEventListener("click", () => edit("lead", { leads: !leads(bodies[0], shown.views[0].kept) }));
  element("design-remove").addEventListener("click", () => edit("remove"));
  element("design-exact").replaceChildren(...data.live.design.map((text) => made("li", {}, text)));
}

// What the hands of the reader were at, kept while the page is loaded anew.
export function keepHands() {
  const { camera, isFitted, layers } = state;
  const { kept } = shown.views[0];
  sessionStorage.setItem("hands", JSON.stringify({ tool: toolName(), leads: element("design-leads").checked, camera, isFitted, layers, kept }));
}

export function takeUpHands() {
  const hands = JSON.parse(sessionStorage.getItem("hands"));
  sessionStorage.removeItem("hands");
  if (!hands || !data.live.design) return;
  document.querySelector(`input[name=tool][value=${hands.tool}]`).checked = true;
  element("design-leads").checked = hands.leads;
  for (const [name, on] of Object.entries(hands.layers)) element(`layer-${name}`).checked = state.layers[name] = on;
  if (!hands.isFitted) Object.assign(state, { camera: hands.camera, isFitted: false });
  if (hands.kept >= 0 && hands.kept < bodies[0].count) keep(shown.views[0], hands.kept);
}
