// Opens a report in Chromium, does what a reader does, and says as JSON what there was to see.
//
//   node tour.mjs REPORT.html '{"find": [["67", 20]], "hover": [0, 5], "painter": "webgl"}'
//
// `find` names particles and values of the clock at which their numbers are asked for by keyboard; `hover` numbers
// particles (from 0) that are pointed at in the last frame.

import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

import { judge, tour, watched } from "../common/browser.mjs";

const [file, asked] = [process.argv[2], JSON.parse(process.argv[3] ?? "{}")];

const seen = { frames: {}, numbers: [], pictures: {} };

async function open(context) {
  const page = await watched(context, seen, 30_000);
  const query = asked.painter ? `?painter=${asked.painter}` : "";
  await page.goto(pathToFileURL(resolve(file)).href + query);
  await page.waitForSelector("body[data-ready=true]");
  return page;
}

// Waits until everything asked for is drawn.
const settled = (page) => page.evaluate(() => new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go))));

const frame = (page) => page.evaluate(() => window.report.player.frame);

const picture = async (page) => {
  await settled(page);
  return page.evaluate(() => window.report.views.map((view) => view.composed().toDataURL()).join());
};

// The view at the end of the film in few pixels, as numbers from 0 to 255.
async function small(page) {
  await page.click("#last");
  await settled(page);
  return page.evaluate(() => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 60, height: 30 });
    const pen = canvas.getContext("2d");
    pen.imageSmoothingQuality = "high";
    pen.drawImage(window.report.views[0].composed(), 0, 0, 60, 30);
    return [...pen.getImageData(0, 0, 60, 30).data];
  });
}

// The numbers shown in an element, as written to the last digit; what is read there is the same to five digits.
const numbersIn = (page, id) =>
  page.evaluate((where) => {
    const rows = [...document.querySelectorAll(`#${where} data`)];
    for (const { dataset, value, textContent } of rows) {
      const read = Number(textContent.replaceAll("−", "-"));
      const off = Math.abs(read - Number(value));
      if (dataset.key !== "role" && value !== "" && !(off <= 1e-5 * Math.abs(Number(value)))) {
        throw new Error(`${dataset.key} is read as ${textContent} and is ${value}`);
      }
    }
    return Object.fromEntries(rows.map((row) => [row.dataset.key, row.value]));
  }, id);

async function play(page) {
  seen.frames.count = await page.evaluate(() => window.report.player.times.length);
  await page.click("#first");
  await settled(page);
  const first = await picture(page);
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press("Space");
  await page.waitForFunction(() => window.report.player.frame >= 3);
  await page.keyboard.press("Space");
  seen.frames.played = await frame(page);
  seen.frames.isPaused = !(await page.evaluate(() => window.report.player.playing));
  await page.keyboard.press("ArrowRight");
  seen.frames.stepped = await frame(page);
  await page.keyboard.press("ArrowLeft");
  seen.frames.back = await frame(page);
  await page.focus("#time");
  await page.keyboard.press("End");
  await settled(page);
  seen.frames.scrubbed = await frame(page);
  seen.frames.moved = first !== (await picture(page));
  seen.now = await page.textContent("#now");
}

async function zoom(page) {
  const scale = () => page.evaluate(() => window.report.state.camera.scale);
  const before = await scale();
  await page.focus(".canvas");
  await page.keyboard.press("+");
  const nearer = await scale();
  await page.keyboard.press("0");
  seen.zoom = [nearer / before, (await scale()) / before];
}

async function find(page) {
  for (const [name, time] of asked.find ?? []) {
    await page.evaluate((at) => window.report.player.seek(at), time);
    await page.fill("#find", name);
    await page.press("#find", "Enter");
    await settled(page);
    seen.numbers.push(await numbersIn(page, "kept"));
  }
  await page.click("#last");
}

async function hover(page) {
  seen.hovered = [];
  for (const particle of asked.hover ?? []) {
    await page.locator(".canvas").first().scrollIntoViewIfNeeded();
    const [x, y] = await page.evaluate((i) => {
      const [view] = window.report.views;
      const box = view.box.getBoundingClientRect();
      const [px, py] = view.at(i);
      return [box.left + px, box.top + py];
    }, particle);
    await page.mouse.move(x, y);
    await settled(page);
    seen.hovered.push(await numbersIn(page, "tip"));
  }
}

async function colours(page) {
  // Under way: at the end, at rest, many quantities are nothing everywhere.
  await page.evaluate(() => window.report.player.go(0.2 * window.report.player.last));
  const names = await page.$$eval("#quantity option", (options) => options.map((option) => option.value));
  for (const name of names) {
    await page.selectOption("#quantity", name);
    seen.pictures[name] = await picture(page);
  }
  // Pictures are compared here: they are large.
  seen.pictures = { names, different: new Set(Object.values(seen.pictures)).size };
  const light = await picture(page);
  await page.click("#theme");
  seen.pictures.themes = light !== (await picture(page));
  await page.click("#theme");
}

// Wheels over the view as it begins, with ctrl, and after that: what became of the view and of the page.
async function wheel(page) {
  await page.focus(".canvas");
  await page.keyboard.press("0");
  // The middle of the window is in the view wherever the page stands after a little scrolling.
  await page.setViewportSize({ width: 1000, height: 500 });
  await page.locator(".canvas").first().scrollIntoViewIfNeeded();
  await settled(page);
  const box = await page.locator(".canvas").first().boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  seen.wheel = [];
  for (const isControlled of [false, true, false]) {
    const before = await page.evaluate(() => [window.scrollY, window.report.state.camera.scale]);
    if (isControlled) await page.keyboard.down("Control");
    await page.mouse.wheel(0, isControlled ? -30 : 30);
    if (isControlled) await page.keyboard.up("Control");
    await page.waitForTimeout(300);
    const after = await page.evaluate(() => [window.scrollY, window.report.state.camera.scale]);
    const touch = await page.evaluate(() => getComputedStyle(document.querySelector(".canvas")).touchAction);
    seen.wheel.push({ scrolled: after[0] !== before[0], zoomed: after[1] !== before[1], touch });
  }
  await page.setViewportSize({ width: 1280, height: 1000 });
}

const view = (page) =>
  page.evaluate(() => {
    const { frame, quantity, camera, compare, turned, layers } = window.report.state;
    return { frame, quantity, compare, turned, layers, camera: Object.values(camera).map((value) => value.toPrecision(4)).join() };
  });

// What the address of a changed view shows in a page of its own.
async function address(page, context) {
  const last = await page.locator("#quantity option").last().getAttribute("value");
  await page.selectOption("#quantity", last);
  await page.evaluate(() => window.report.player.go(Math.round(0.4 * window.report.player.last)));
  await page.click("#turn");
  await page.uncheck("#layer-points");
  await page.focus(".canvas");
  await page.keyboard.press("+");
  // The address follows once the view is at rest.
  await page.waitForTimeout(800);
  const other = await context.newPage();
  await other.goto(page.url());
  await other.waitForSelector("body[data-ready=true]");
  await settled(other);
  seen.address = [last, await view(page), await view(other)];
  await other.goto(`${page.url().split("#")[0]}#at=NaN&colour=%3Cb%3E&view=1,2&compare=x&enlarged=-1`);
  await other.reload();
  await other.waitForSelector("body[data-ready=true]");
  seen.nonsense = await view(other);
  await other.close();
}

// The second body laid over the first, and the first less the second: pictures, and the values that are coloured.
async function compare(page) {
  await page.selectOption("#quantity", "von_mises");
  const beside = await picture(page);
  seen.seams = await seams(page);
  await page.selectOption("#compare", "slider");
  await page.locator("#edge").fill("30");
  await settled(page);
  const [clip, boxes, line] = await page.evaluate(() => {
    const all = [...document.querySelectorAll(".canvas")];
    const { content, left, width } = getComputedStyle(all[1], "::after");
    const line = [content, width, Math.round((100 * parseFloat(left)) / all[1].clientWidth)];
    return [getComputedStyle(all[1]).clipPath, all.map((box) => JSON.stringify(box.getBoundingClientRect())), line];
  });
  await page.selectOption("#compare", "difference");
  await page.selectOption("#quantity", "von_mises");
  await settled(page);
  const apart = await page.evaluate(() => {
    const [a, b] = window.report.bodies.map((body) => body.field("von_mises"));
    const { shades } = window.report.views[0];
    // By its colour: a half is nothing.
    const signs = [...shades].map((shade, i) => (shade < 0 ? 0 : Math.sign(shade - 0.5) * Math.sign(a[i] - b[i])));
    return { wrong: signs.filter((sign) => sign < 0).length, right: signs.filter((sign) => sign > 0).length };
  });
  const scale = await page.getAttribute("#scale", "aria-label");
  seen.compare = { clip, line, isOver: boxes[0] === boxes[1], apart, scale, differs: beside !== (await picture(page)) };
  await page.selectOption("#compare", "side");
}

// The shape in which a particle of each role is drawn: whether the corner of a square and the tip of a diamond are covered.
async function shapes(page) {
  await page.click("#last");
  await page.selectOption("#quantity", "role");
  seen.shapes = await page.evaluate(async () => {
    const { views: [view], state } = window.report;
    const { body } = view;
    const layer = (name) => document.getElementById(`layer-${name}`);
    for (const name of ["bonds", "surface", "cracks", "ways"]) layer(name).checked = state.layers[name] = false;
    layer("points").checked = true;
    const found = {};
    for (const [role, name] of body.animation.role_names.entries()) {
      // Some of a comparison's have no place.
      const particle = [...body.roles()].findIndex((one, i) => one === role && Number.isFinite(body.dx[i]));
      if (particle < 0) continue;
      const [x, y] = view.shown([body.X[particle] + state.factor * body.dx[particle], body.Y[particle] + state.factor * body.dy[particle]]);
      state.camera = { x, y, scale: 60 / body.animation.spacing };
      state.isFitted = false;
      layer("points").dispatchEvent(new Event("change"));
      await new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)));
      const picture = Object.assign(document.createElement("canvas"), { width: view.middle.width, height: view.middle.height });
      const pen = picture.getContext("2d");
      pen.drawImage(view.middle, 0, 0);
      const [px, py] = view.at(particle);
      const r = view.radii[particle];
      const covered = (right, down) => pen.getImageData(px * view.ratio + right * r, py * view.ratio + down * r, 1, 1).data[3] > 128;
      found[name] = [covered(0.78, 0.78), covered(1.1, 0)];
    }
    return found;
  });
  seen.signs = await page.$$eval("#scale .key", (keys) => keys.map((one) => [one.textContent.split(" ").slice(1).join(" "), one.firstChild.className]));
  await page.focus(".canvas");
  await page.keyboard.press("0");
}

// Pixels of a filled body through which paper is seen though the body is all around them.
const seams = (page) =>
  page.evaluate(() =>
    window.report.views.map(({ middle: canvas }) => {
      const { width, height } = canvas;
      const copy = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d");
      copy.drawImage(canvas, 0, 0);
      const { data } = copy.getImageData(0, 0, width, height);
      const cover = (x, y) => data[4 * (y * width + x) + 3];
      let count = 0;
      for (let y = 4; y < height - 4; y++) {
        for (let x = 4; x < width - 4; x++) {
          const isSoft = cover(x, y) > 0 && cover(x, y) < 250;
          if (isSoft && [[4, 0], [-4, 0], [0, 4], [0, -4]].every(([u, v]) => cover(x + u, y + v) > 250)) count++;
        }
      }
      return count;
    }),
  );

// The end of the scale of the stress, and how whole the body is that it fills.
async function stress(page) {
  await settled(page);
  const ends = await page.evaluate(() => {
    const range = window.report.state.ranges.get("von_mises");
    return { end: String(range.high), largest: String(range.largest) };
  });
  seen.scale = ends;
  seen.seams = await seams(page);
}

// A quantity of every particle at a time.
function fields(page) {
  return page.evaluate((all) => {
    const { bodies: [body], player } = window.report;
    return all.map(([key, time]) => {
      player.seek(time);
      body.go(body.animation.times.indexOf(time));
      return Array.from(body.field(key));
    });
  }, asked.fields);
}

// What the picture buttons save.
async function saved(page) {
  seen.saved = {};
  await page.focus(".canvas");
  await page.keyboard.press("0");
  await settled(page);
  for (const [button, kind] of [["picture", "png"], ["drawing", "svg"]]) {
    const [download] = await Promise.all([page.waitForEvent("download"), page.click(`#${button}`)]);
    const bytes = readFileSync(await download.path());
    const name = download.suggestedFilename();
    seen.saved[kind] = { name, size: bytes.length };
    if (kind === "png") seen.saved.png.pixels = [bytes.readUInt32BE(16), bytes.readUInt32BE(20)];
    else seen.saved.svg.texts = await page.evaluate((text) => {
      const drawing = new DOMParser().parseFromString(text, "image/svg+xml");
      return [...drawing.querySelectorAll("parsererror, title, text")].map((one) => one.textContent);
    }, bytes.toString());
    if (kind === "svg") seen.saved.svg.dashed = bytes.toString().split('stroke-dasharray="3 2"').length - 1;
  }
  seen.saved.shown = await page.evaluate(() => ["h1", "#now", "#scale > span"].map((of) => document.querySelector(of).textContent));
  seen.saved.views = await page.evaluate(() => window.report.views.map((one) => one.middle.width));
}

// What is cut off or has to be scrolled to sideways on a phone.
async function phone(page) {
  await page.setViewportSize({ width: 390, height: 844 });
  await settled(page);
  await page.waitForTimeout(200);
  seen.cut = await page.evaluate(() => {
    const width = document.documentElement.clientWidth;
    const cut = document.documentElement.scrollWidth > width ? [`the page is ${document.documentElement.scrollWidth} wide`] : [];
    for (const one of document.querySelectorAll("body *:not(script):not(style)")) {
      if (one.closest("pre, [hidden]") || !one.getClientRects().length) continue;
      const { left, right, width: own } = one.getBoundingClientRect();
      if (own && (right > width + 0.5 || left < -0.5)) cut.push(`${one.tagName} ${one.id} ${one.textContent.slice(0, 40)}`);
    }
    for (const one of document.querySelectorAll(".table, th, td, .facts dd"))
      if (one.scrollWidth > one.clientWidth + 1) cut.push(`${one.tagName} is ${one.scrollWidth} wide: ${one.textContent.slice(0, 40)}`);
    for (const text of document.querySelectorAll(".plots svg text")) {
      const [own, all] = [text.getBoundingClientRect(), text.ownerSVGElement.getBoundingClientRect()];
      if (own.left < all.left - 0.5 || own.right > all.right + 0.5 || own.bottom > all.bottom + 0.5) cut.push(text.textContent);
    }
    return cut;
  });
  await page.setViewportSize({ width: 1280, height: 1000 });
}

async function points(page) {
  seen.points = [];
  for (const dot of await page.$$("#plots svg circle[stroke-width='1.5']")) {
    if (seen.points.length >= 3) break;
    const box = await dot.boundingBox();
    if (!box || !(await dot.evaluate((one) => one.closest("figure > div:not(.legend)")))) continue;
    await dot.scrollIntoViewIfNeeded();
    await dot.hover({ force: true });
    seen.points.push(await page.textContent("#tip"));
  }
}

await tour("browser", seen, async (context) => {
  const page = await open(context);
  seen.views = await page.evaluate(() => window.report.views.length);
  seen.charts = await page.evaluate(() => document.querySelectorAll("#plots figure").length);
  if (seen.views) {
    seen.painter = await page.evaluate(() => window.report.views[0].painter.constructor.name);
    if ((await page.inputValue("#quantity")) === "von_mises") await stress(page);
    if (asked.fields) seen.fields = await fields(page);
    if (asked.small) seen.small = await small(page);
    await play(page);
    await zoom(page);
    await find(page);
    await hover(page);
    await colours(page);
    await wheel(page);
    if (asked.compare) await compare(page);
    await shapes(page);
    await saved(page);
    await address(page, context);
  }
  await phone(page);
  seen.command = await page.textContent("#command");
  await points(page);
  seen.title = await page.title();
  await judge(page, seen);
});
