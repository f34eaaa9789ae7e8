// A page that a session feeds: the socket, the clock, the controls of the session.

import { follow, refit } from "./camera.js";
import { words } from "./colour.js";
import { breakBonds, kindOf, LiveFrames } from "./live_frames.js";
import { isDesigning, keepHands, listenToDesign, showDesign, takeDesign, takeUpHands } from "./live_design.js";
import { drawAlarms, drawDashes, drawTargets, takeFormation, takeTool, toolName } from "./live_tools.js";
import { drawNow, started } from "./page.js";
import { bodies, data, element, made, shown, state } from "./shown.js";

// Time between two looks at the range of a quantity and at the room in the view, which change as the body moves, in ms.
const RANGE_EVERY = 250;
// Keys worth a try that a file may leave out.
const SUGGESTED = ["update.damping=0.8", "rule.feedback.factor=-0.05", "fracture.stretch=1.5", "frame=immediate"];
// Time after which a node's page tries to connect again, in ms.
const AGAIN_AFTER = 1000;
// Time after which a frame is drawn though the browser does not ask for it, in ms.
const HIDDEN_EVERY = 300;

const session = { socket: null, status: { alarmed: [], faults: [] }, frame: null, isAsked: false, rangeAt: 0, alarms: "", sets: null };
const measured = { drawn: 0, since: 0, rate: 0, transfer: 0, drawing: 0 };

// Requests that go on with an act, or are none: what was said before still holds.
const NO_ACTS = new Set(["ask", "drawn", "drag", "squeeze", "release"]);

function ask(command) {
  if (session.socket?.readyState !== WebSocket.OPEN) return;
  // Words are those of the last act: the next one clears or replaces them.
  if (!NO_ACTS.has(command.do)) say("");
  session.socket.send(JSON.stringify(command));
}

// The clock of a session, in the place of a film's: it knows the present alone.
class LivePlayer {
  constructor() {
    Object.assign(this, { times: bodies[0].animation.times, frame: 0, ready: 1, playing: false, isLive: true, tempo: 1 });
  }

  get last() {
    return 0;
  }

  get speed() {
    return this.tempo;
  }

  set speed(value) {
    this.tempo = value;
    ask({ do: "speed", value });
  }

  toggle() {
    if (!data.live.node) ask({ do: this.playing ? "pause" : "play" });
  }

  pause() {}

  // One on is a step; the only other place is the one before the last deed.
  go(frame) {
    if (data.live.node) return;
    if (frame > 0) ask({ do: "step" });
    else if (frame < 0) ask({ do: "undo" });
  }

  seek() {}
}

// A refusal looks like one, and is read out at once.
function say(text, isRefusal = false) {
  const words = element("live-words");
  // What a session goes on saying is read out once.
  if (words.textContent === text) return;
  words.className = isRefusal ? "note bad" : "note";
  words.setAttribute("role", isRefusal ? "alert" : "status");
  words.textContent = text;
}

function connect() {
  const token = new URLSearchParams(location.search).get("token") ?? "";
  const socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(token)}`);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data: message }) => (typeof message === "string" ? hear(JSON.parse(message)) : receive(message));
  socket.onopen = () => {
    document.body.dataset.live = "open";
    if (data.live.node) say("");
    askForQuantity();
  };
  socket.onclose = () => {
    document.body.dataset.live = "closed";
    // A node's next process serves the same address.
    if (data.live.node) {
      say("No connection to the node: what is shown is old. Trying again.", true);
      setTimeout(connect, AGAIN_AFTER);
    } else say("The session is over, or has no room for another viewer.", true);
  };
  session.socket = socket;
}

function hear(event) {
  // A number that was refused is still in its field.
  if (event.event === "refused") session.sets = null;
  if (event.event === "refused" || event.event === "done") say(event.words, event.event === "refused");
  else if (event.event === "saved") {
    say(`Saved as ${event.path}. Replay: ${event.command}`);
    document.body.dataset.saved = event.path;
  } else if (event.event === "status") takeStatus(event);
}

function loadAnew() {
  keepHands();
  location.reload();
}

function takeStatus(status) {
  // Another body: another page.
  if (status.layout !== data.live.layout) return loadAnew();
  const { stopped } = session.status;
  session.status = status;
  shown.player.tempo = status.speed;
  if (shown.player.playing !== status.playing) {
    shown.player.playing = status.playing;
    shown.player.changed?.();
  }
  element("speed").value = String(status.speed);
  element("live-undo").disabled = status.undo === 0;
  if (status.stopped) say(status.stopped, true);
  else if (stopped && element("live-words").textContent === stopped) say("");
  if (element("command").textContent !== status.command) element("command").textContent = status.command;
  ["cut", "load"].forEach((tool) => offer(tool, status.tools.includes(tool)));
  if (status.node) takeNode(status.node);
  // The page knows the present alone: where they are now is where they ever were.
  status.obstacles.forEach((by, k) => (bodies[0].animation.outlines[k].moves = [[-Infinity, ...by]]));
  const alarms = status.alarms.join("\n");
  if (alarms !== session.alarms) {
    session.alarms = alarms;
    element("live-alarms").replaceChildren(...status.alarms.map((text) => made("li", {}, text)));
  }
  const sets = status.sets.join("\n");
  if (sets !== session.sets) {
    session.sets = sets;
    takeSets(status.sets);
  }
}

// Numbers that were changed, here or by another viewer.
function takeSets(sets) {
  const values = new Map(data.live.keys.map(([key, value]) => [key, value === null ? "" : String(value)]));
  for (const text of sets) {
    const at = text.indexOf("=");
    values.set(text.slice(0, at).trim(), text.slice(at + 1).trim());
  }
  for (const [key, value] of values) {
    const isNumber = value !== "" && Number.isFinite(Number(value));
    const input = numberOf(key) ?? (isNumber ? addNumber(key, value) : null);
    if (!input) continue;
    input.dataset.now = tidy(value);
    if (input !== document.activeElement && input.value !== input.dataset.now) input.value = input.dataset.now;
  }
  // What was undone and is no number of the file is none to change.
  for (const input of document.querySelectorAll("#live-numbers input")) if (!values.has(input.dataset.key)) input.parentElement.remove();
}

function numberOf(key) {
  return [...document.querySelectorAll("#live-numbers input")].find((input) => input.dataset.key === key);
}

// Without the last digits of a binary number: 0.8009999999999998, which a box counts up to, is 0.801.
function tidy(value) {
  return value === "" ? "" : String(Number(Number(value).toPrecision(12)));
}

// A box for a number; an empty one stands for none.
function addNumber(key, value) {
  const now = tidy(String(value ?? ""));
  const input = made("input", { type: "number", step: "any", value: now, placeholder: "none" });
  Object.assign(input.dataset, { key, now });
  input.addEventListener("change", () => {
    // What was emptied shows again what holds.
    if (input.value === "") input.value = input.dataset.now;
    else set(key, (input.value = tidy(input.value)));
  });
  element("live-numbers").append(made("label", {}, `${key} `, input));
  return input;
}

// A body without a material has no stress that a load could be in balance with, one of cells no bonds to cut.
function offer(tool, isOffered) {
  element(`tool-${tool}`).hidden = !isOffered;
  if (isOffered || toolName() !== tool) return;
  document.querySelector("input[name=tool][value=drag]").checked = true;
  showHint();
}

// What dragging does, by the tool.
function showHint() {
  const dragged = data.live.swarm ? "a leader or an obstacle to move it" : "a particle to lead it";
  const hints = {
    drag: `Drag ${dragged}, elsewhere to move the view`,
    cut: "Drag across bonds to cut them",
    load: "Drag a side of the body to load it",
    place: "Click for another robot, drag one to another place",
    link: "Drag from robot to robot to link them, or to part them",
    look: "Drag to move the view",
  };
  element("hint").textContent = hints[toolName()];
}

// What a node says of itself: empty fields of the form stand for the posture that the leaders have now.
function takeNode(node) {
  const inMode = (mode) => node.mode.startsWith(mode);
  element("node-mode").textContent = node.mode;
  element("node-mode").className = inMode("emergency") ? "bad" : "";
  element("node-resume").disabled = !(element("node-stop").disabled = inMode("emergency"));
  element("node-switch").textContent = inMode("inactive") ? "activate" : "deactivate";
  const { elements } = element("node-move");
  for (const [name, value] of Object.entries(postureFields(node))) elements[name].placeholder = words(value);
}

function postureFields({ translate: [x, y], rotate, stretch }) {
  return { x, y, turn: (rotate * 180) / Math.PI, "stretch-x": stretch[0], "stretch-y": stretch[1] };
}

function moveFormation(by) {
  const { node } = session.status;
  const { elements } = element("node-move");
  const now = postureFields(node);
  const value = (name) => (elements[name].value === "" || by ? now[name] : elements[name].valueAsNumber);
  const translate = ["x", "y"].map((name, k) => value(name) + (by?.[k] ?? 0));
  const stretch = [value("stretch-x"), value("stretch-y")];
  const rotate = (value("turn") * Math.PI) / 180;
  ask({ do: "set-formation", translate, rotate, stretch, shear: node.shear, duration: elements.duration.valueAsNumber || 0 });
}

function listenToNode({ commands, manoeuvres }) {
  document.body.classList.add("is-node");
  element("live-node").hidden = false;
  element("node-commands").hidden = element("live-tools").hidden = !commands;
  document.querySelector("input[name=tool][value=look]").checked = true;
  element("node-stop").addEventListener("click", () => ask({ do: "emergency-stop" }));
  element("node-resume").addEventListener("click", () => ask({ do: "resume" }));
  element("node-switch").addEventListener("click", ({ target }) => ask({ do: target.textContent }));
  const onSubmit = (id, send) =>
    element(id).addEventListener("submit", (event) => {
      event.preventDefault();
      send();
    });
  onSubmit("node-move", () => moveFormation());
  onSubmit("node-manoeuvre", () => ask({ do: "set-formation", name: element("node-manoeuvre").elements.name.value }));
  element("node-manoeuvre").hidden = manoeuvres.length === 0;
  element("node-manoeuvre").elements.name.replaceChildren(...manoeuvres.map((name) => made("option", { value: name }, name)));
  const mark = (from, to) => (session.pull = from && [from, to]);
  shown.tool = (view, at) => takeFormation(view, at, mark, moveFormation);
}

function receive(buffer) {
  const [body] = bodies;
  const kind = kindOf(buffer);
  if (kind === "roles") {
    body.firstRoles = new Uint8Array(buffer, 8);
    body.roleChanges = [];
  } else if (kind === "broken") {
    breakBonds(body, buffer);
    shown.views.forEach((view) => view.painter.setMesh(body));
    element("layer-cracks").closest("label").hidden = !body.brokenBonds();
  } else if (kind === "frame") {
    session.frame = buffer;
    // A frame that a later one replaces before it is drawn counts as drawn: the session waits for each.
    if (session.isAsked) return ask({ do: "drawn", ms: 0 });
    session.isAsked = true;
    requestAnimationFrame(drawLatest);
    // A page in the background is not refreshed.
    setTimeout(drawLatest, HIDDEN_EVERY);
  }
}

function drawLatest() {
  if (!session.isAsked) return;
  session.isAsked = false;
  const begun = performance.now();
  const frame = bodies[0].frames.take(session.frame);
  if (!frame) return loadAnew();
  const [body] = bodies;
  body.animation.times[0] = frame.clock;
  body.at = -1;
  if (begun - session.rangeAt > RANGE_EVERY) {
    state.ranges.clear();
    session.rangeAt = begun;
    if (!data.live.swarm) follow();
  }
  // Few robots move fast: one would be half out before the next look.
  if (data.live.swarm) follow();
  drawNow();
  const drawing = performance.now() - begun;
  ask({ do: "drawn", ms: Math.min(drawing, 1e6) });
  measure(frame, performance.timeOrigin + begun - frame.sent, drawing);
}

// Means over some frames; said twice a second.
function measure(frame, transfer, drawing) {
  measured.transfer += 0.1 * (transfer - measured.transfer);
  measured.drawing += 0.1 * (drawing - measured.drawing);
  measured.drawn += 1;
  const now = performance.now();
  if (now - measured.since < 500) return;
  measured.rate = (1000 * measured.drawn) / (now - measured.since);
  Object.assign(measured, { drawn: 0, since: now, step: frame.stepTime, encoding: frame.frameTime });
  const [steps] = session.status.rates ?? [0];
  const engine = data.live.node ? "states/s;" : `steps/s; a step takes ${words(frame.stepTime, 2)} ms,`;
  element("loading").textContent =
    `${words(measured.rate, 3)} frames/s, ${words(steps, 3)} ${engine} a frame ` +
    `${words(frame.frameTime, 2)} ms to make, ${words(measured.transfer, 2)} ms to come, ${words(measured.drawing, 2)} ms to draw.`;
}

function askForQuantity() {
  ask({ do: "ask", quantity: state.quantity });
}

function set(key, value) {
  ask({ do: "set", key: key.trim(), value: String(value).trim() });
}

function showNumbers() {
  data.live.keys.forEach(([key, value]) => addNumber(key, value));
  const known = data.live.keys.filter(([, value]) => value !== null).map(([key, value]) => `${key}=${value}`);
  const offered = data.live.swarm ? known : [...known, ...SUGGESTED.filter((text) => !known.some((one) => one.startsWith(text.split("=")[0])))];
  element("live-keys").replaceChildren(...offered.map((value) => made("option", { value })));
}

// A slider that holds the leaders while it is moved, and goes back to the middle when it is let go.
function listenToSqueeze(slider) {
  let isHeld = false;
  slider.addEventListener("input", () => {
    const leader = bodies[0].firstRoles.indexOf(bodies[0].animation.role_names.indexOf("leader"));
    if (leader < 0) return say("No program of this swarm leads a robot.", true);
    if (!isHeld) ask({ do: "grab", particle: leader });
    isHeld = true;
    ask({ do: "squeeze", by: [slider.valueAsNumber, slider.valueAsNumber] });
  });
  slider.addEventListener("change", () => {
    if (isHeld) ask({ do: "release" });
    isHeld = false;
    slider.value = "1";
  });
}

function listenToSession() {
  element("live-reset").addEventListener("click", () => ask({ do: "reset" }));
  element("live-undo").addEventListener("click", () => ask({ do: "undo" }));
  element("live-save").addEventListener("click", () => ask({ do: "save" }));
  element("live-set").addEventListener("submit", (event) => {
    event.preventDefault();
    const text = element("live-key").value;
    const at = text.indexOf("=");
    if (at > 0) set(text.slice(0, at), text.slice(at + 1));
    else say("Give KEY=VALUE, as --set takes it.", true);
  });
  element("quantity").addEventListener("change", askForQuantity);
  listenToSqueeze(element("live-squeeze"));
  element("live-fault").addEventListener("change", () => {
    const robot = shown.views[0].kept;
    const what = element("live-fault").value || null;
    if (robot >= 0) return ask({ do: "fault", robot, what });
    say("Click a robot first.", true);
    showFault(shown.views[0]);
  });
}

// The list has the fault of the robot that was clicked.
function showFault({ body, kept }) {
  const fault = session.status.faults.find(([robot]) => robot === kept)?.[1] ?? "";
  const [list, name] = [element("live-fault"), kept < 0 ? "Robot" : body.name(kept)];
  if (list.value !== fault) list.value = fault;
  if (element("live-chosen").textContent !== name) element("live-chosen").textContent = name;
}

// How high a view may be so that the legend and the clock below it are in the window.
function roomFor({ box }) {
  const [view, clock] = [box, element("now").closest(".transport")].map((one) => one.getBoundingClientRect());
  return window.innerHeight - (view.top + window.scrollY) - (clock.bottom - view.bottom) - 10;
}

function startLive() {
  const [body] = bodies;
  const { changed } = shown.player;
  body.frames = new LiveFrames(data.live.channels, body.count);
  shown.player = Object.assign(new LivePlayer(), { changed });
  shown.say = say;
  shown.tool = (view, at, event) => (isDesigning() ? takeDesign(view, at, ask) : takeTool(view, at, event, ask));
  // Of a body nothing is drawn on top, and an empty canvas stays as it is.
  if (data.live.swarm)
    shown.over = (view) => {
      showDesign();
      showFault(view);
      drawTargets(view);
      drawAlarms(view, session.status);
      if (session.pull) drawDashes(view, ...session.pull);
    };
  element("layer-ways").closest("label").hidden = true;
  element("layer-ways").checked = state.layers.ways = false;
  element("layer-cracks").closest("label").hidden = true;
  element("tool-cut").hidden = element("tool-load").hidden = true;
  element("tool-place").hidden = element("tool-link").hidden = !data.live.design;
  element("live-robot").hidden = !data.live.swarm || Boolean(data.live.node);
  showNumbers();
  document.querySelectorAll("input[name=tool]").forEach((tool) => tool.addEventListener("change", showHint));
  listenToSession();
  if (data.live.node) listenToNode(data.live.node);
  if (data.live.design) listenToDesign(ask, () => bodies[0].animation.times[0] === 0);
  takeUpHands();
  showHint();
  window.report.live = { session, measured, ask };
  connect();
}

if (data.live) {
  // Before the first view is fitted.
  document.body.classList.add("is-live");
  shown.roomFor = roomFor;
  shown.keys = { u: () => !data.live.node && ask({ do: "undo" }) };
  window.addEventListener("resize", () => state.isFitted && shown.player?.ready && refit());
  started.then(startLive);
}
