// What is shown as a picture of its own, with title, names, clock and scale: as a PNG, or as an SVG whose lines, letters and
// dots are vectors.

import { themeText } from "./colour.js";
import { traceMark } from "./marks.js";
import { CRACK_DASH } from "./view.js";
import { SvgPen } from "./svg_pen.js";
import { draw, drawNow } from "./page.js";
import { crackKeys, quantities, ramp, roleKeys, scaleOf } from "./scale.js";
import { element, made, shown, state } from "./shown.js";

// In CSS pixels.
const MARGIN = 16;
const GAP = 12;
const TITLE = 22;
const LINE = 18;
const BAR = { width: 300, height: 12 };
// Pixels to a CSS pixel, at least: as many as print takes.
export const PRINT_SHARPNESS = 2;
// More dots and lines than this would make a file too large to open: they go in as the picture they are.
const MOST_VECTORS = 20000;

export function savePicture() {
  sharply(writePicture);
}

export function saveDrawing() {
  sharply(writeDrawing);
}

// Does something while the views are drawn as sharply as print takes them.
export function sharply(act) {
  shown.sharpness = Math.max(PRINT_SHARPNESS, window.devicePixelRatio || 1);
  drawNow();
  try {
    act();
  } finally {
    shown.sharpness = null;
  }
  draw();
}

function writePicture() {
  const sheet = sheetOf();
  const { ratio } = shown.views[0];
  const canvas = made("canvas", { width: Math.round(sheet.width * ratio), height: Math.round(sheet.height * ratio) });
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  sheet.paint(pen);
  save(canvas.toDataURL("image/png"), "png");
}

function writeDrawing() {
  const sheet = sheetOf();
  const pen = new SvgPen(sheet.width, sheet.height, document.title);
  sheet.paint(pen);
  save(URL.createObjectURL(new Blob([pen.text()], { type: "image/svg+xml" })), "svg");
}

function save(href, ending) {
  const { label } = quantities().find(({ key }) => key === state.quantity);
  made("a", { href, download: `${document.title}, ${label}, ${element("now").textContent}.${ending}` }).click();
  if (href.startsWith("blob:")) setTimeout(() => URL.revokeObjectURL(href), 1000);
}

// The size of the sheet, and what paints it.
function sheetOf() {
  const views = shown.views.filter((view) => view.isSeen);
  // One laid over the other takes no place beside it.
  const beside = state.compare === "slider" ? views.slice(0, 1) : views;
  const names = views.map((view) => view.box.parentElement.querySelector("figcaption")?.textContent ?? "");
  const top = MARGIN + TITLE + (names.some(Boolean) ? LINE : 0);
  const width = beside.reduce((sum, view) => sum + view.width + GAP, -GAP) + 2 * MARGIN;
  const height = top + views[0].height + GAP + BAR.height + LINE + MARGIN;
  return { width, height, paint };

  function paint(pen) {
    pen.fillStyle = themeText("card");
    pen.fillRect(0, 0, width, height);
    const clock = element("now").textContent;
    pen.font = "600 15px system-ui, sans-serif";
    const room = width - 2 * MARGIN - 20 - pen.measureText(clock).width;
    write(pen, shortened(pen, document.title, room), MARGIN, MARGIN + 13);
    pen.font = "13px system-ui, sans-serif";
    write(pen, clock, width - MARGIN - pen.measureText(clock).width, MARGIN + 13, "soft");
    let left = MARGIN;
    views.forEach((view, n) => {
      const over = state.compare === "slider" && n > 0;
      const edge = over ? edgeOf(view) : 0;
      pen.font = "13px system-ui, sans-serif";
      const name = over ? MARGIN + view.width - pen.measureText(names[n]).width : left;
      write(pen, names[n], name, top - 6);
      within(pen, [left + edge, top, view.width - edge, view.height], [left, top], () => paintView(pen, view));
      pen.strokeStyle = themeText("line");
      pen.lineWidth = 1;
      pen.strokeRect(left + edge, top, view.width - edge, view.height);
      if (over) {
        // As on the page, the second body begins behind a line.
        pen.fillStyle = themeText("ink");
        pen.fillRect(left + edge, top, 2, view.height);
      }
      if (state.compare !== "slider") left += view.width + GAP;
    });
    paintScale(pen, top + views[0].height + GAP);
  }

  function paintScale(pen, y) {
    pen.font = "13px system-ui, sans-serif";
    let x = MARGIN;
    if (state.quantity === "role") {
      paintKeys(pen, [...roleKeys(), ...crackKeys()], x, y);
      return;
    }
    const { name, ticks, more } = scaleOf();
    write(pen, name, x, y + 11);
    x += pen.measureText(name).width + 14;
    const long = Math.max(Math.min(BAR.width, width - MARGIN - x), 80);
    pen.drawImage(ramp(), x, y, long, BAR.height);
    pen.font = "11px system-ui, sans-serif";
    for (const [part, text] of ticks) write(pen, text, x + part * long - pen.measureText(text).width / 2, y + BAR.height + 13);
    const keys = more ? [[more, null], ...crackKeys()] : crackKeys();
    paintKeys(pen, keys, x + long + 20, y);
  }

  // Texts in a row, each behind a mark of its colour; what has no room is left out.
  function paintKeys(pen, keys, from, y) {
    let x = from;
    for (const [text, colour, mark] of keys) {
      const long = pen.measureText(text).width + (colour ? 18 : 0);
      if (x + long > width - MARGIN) return;
      if (mark === "crack") dashes(pen, x, y + 7, 13, colour);
      else if (colour) sign(pen, mark, x + 6, y + 7, 5, colour);
      write(pen, text, x + (colour ? 16 : 0), y + 11);
      x += long + 18;
    }
  }
}

// The edge of the view that is laid over another, as its clip has it.
function edgeOf(view) {
  return Number(getComputedStyle(element("views")).getPropertyValue("--edge")) * view.width;
}

function paintView(pen, view) {
  view.paintUnder(pen);
  const { layers } = state;
  const { body } = view;
  const isDrawn = pen instanceof SvgPen && !layers.surface && body.count + body.bonds.length / 2 <= MOST_VECTORS;
  if (isDrawn) paintBody(pen, view);
  else pen.drawImage(view.middle, 0, 0, view.width, view.height);
  view.paintOver(pen);
}

// Bonds and particles as the painters have them.
function paintBody(pen, view) {
  const { body, shades, radii, ratio } = view;
  const { layers, palette } = view.show;
  if (layers.bonds) {
    pen.strokeStyle = themeText("bond");
    pen.lineWidth = 1;
    pen.beginPath();
    for (let n = 2 * body.brokenBonds(); n < body.bonds.length; n += 2) {
      const [a, b] = [view.at(body.bonds[n]), view.at(body.bonds[n + 1])];
      if (![...a, ...b].every((value) => Math.abs(value) < 1e5)) continue;
      pen.moveTo(...a);
      pen.lineTo(...b);
    }
    pen.stroke();
  }
  if (!layers.points) return;
  for (let i = 0; i < body.count; i++) {
    const [x, y] = view.at(i);
    if (!(x > -50 && y > -50 && x < view.width + 50 && y < view.height + 50)) continue;
    const shade = shades[i] < 0 ? palette.length / 4 - 1 : Math.round(shades[i] * (palette.length / 4 - 2));
    const [r, g, b] = palette.subarray(4 * shade, 4 * shade + 3);
    sign(pen, view.marks[i], x, y, radii[i] / ratio, `rgb(${r}, ${g}, ${b})`);
  }
}

function sign(pen, mark, x, y, radius, colour) {
  pen.fillStyle = colour;
  pen.beginPath();
  traceMark(pen, mark, x, y, radius);
  pen.fill();
}

function dashes(pen, x, y, long, colour) {
  Object.assign(pen, { strokeStyle: colour, lineWidth: 2 });
  pen.setLineDash(CRACK_DASH);
  pen.beginPath();
  pen.moveTo(x, y);
  pen.lineTo(x + long, y);
  pen.stroke();
  pen.setLineDash([]);
}

function write(pen, text, x, y, colour = "ink") {
  pen.fillStyle = themeText(colour);
  pen.fillText(text, x, y);
}

// As much of a text as has room.
function shortened(pen, text, room) {
  if (pen.measureText(text).width <= room) return text;
  let short = text;
  while (short && pen.measureText(`${short}…`).width > room) short = short.slice(0, -1);
  return `${short}…`;
}

// Paints with the origin at a place, and nothing outside a window.
function within(pen, [x, y, width, height], origin, paint) {
  pen.save();
  pen.beginPath();
  pen.rect(x, y, width, height);
  pen.clip();
  pen.translate(...origin);
  paint();
  pen.restore();
}
