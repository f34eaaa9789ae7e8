// Opens a report in Chromium, does what a reader does, and says as JSON what there was to see.
//
//   node tour.mjs REPORT.html '{"find": [["67", 20]], "hover": [0, 5], "painter": "webgl"}'
//
// `find` names particles and values of the clock at which their numbers are asked for by keyboard; `hover` numbers
// particles (from 0) that are pointed at in the last frame. FLOCKFORM_NODE_MODULES is a folder with playwright-core and
// axe-core.

import { createRequire } from "node:module";
import { readFileSync } from "node:fs";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const modules = join(resolve(process.env.FLOCKFORM_NODE_MODULES ?? "node_modules"), "/");
const { chromium } = createRequire(modules)("playwright-core");
const axe = readFileSync(join(modules, "axe-core/axe.min.js"), "utf8");
const [file, asked] = [process.argv[2], JSON.parse(process.argv[3] ?? "{}")];

const FLAGS = [
  "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
];

const seen = { errors: [], requests: [], frames: {}, numbers: [], pictures: {}, faults: [] };

async function open(context) {
  const page = await context.newPage();
  page.setDefaultTimeout(30_000);
  page.on("console", (message) => message.type() === "error" && seen.errors.push(message.text()));
  page.on("pageerror", (error) => seen.errors.push(error.message));
  page.on("request", (request) => seen.requests.push(request.url().slice(0, 60)));
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

// The numbers shown in an element, as written to the last digit.
const numbersIn = (page, id) =>
  page.evaluate((where) => {
    const rows = [...document.querySelectorAll(`#${where} data`)];
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

async function judge(page, theme) {
  await page.addScriptTag({ content: axe });
  const result = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  const serious = result.violations.filter((one) => one.impact === "serious" || one.impact === "critical");
  seen.faults.push(...serious.map((one) => `${theme}: ${one.id}: ${one.nodes.map((node) => node.target).join(" ")}`));
}

const profile = mkdtempSync(join(tmpdir(), "flockform-browser-"));
const executablePath = process.env.FLOCKFORM_CHROMIUM ?? "/usr/bin/chromium";
const options = { executablePath, args: FLAGS, headless: true, viewport: { width: 1280, height: 1000 } };
const context = await chromium.launchPersistentContext(profile, options);
try {
  const page = await open(context);
  seen.views = await page.evaluate(() => window.report.views.length);
  seen.charts = await page.evaluate(() => document.querySelectorAll("#plots figure").length);
  if (seen.views) {
    seen.painter = await page.evaluate(() => window.report.views[0].painter.constructor.name);
    if (asked.small) seen.small = await small(page);
    await play(page);
    await zoom(page);
    await find(page);
    await hover(page);
    await colours(page);
  }
  await points(page);
  seen.title = await page.title();
  for (const theme of ["light", "dark"]) {
    await page.evaluate((name) => (document.documentElement.dataset.theme = name), theme);
    await settled(page);
    await judge(page, theme);
  }
  console.log(JSON.stringify(seen));
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
