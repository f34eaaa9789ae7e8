// Does in a live page what a hand does, and says as JSON what there was to see.
//
//   node tour.mjs ADDRESS '{"drag": 66, "cut": [[4.5, 2], [4.6, 8]], "key": "rule.feedback.factor=-0.05"}'
//
// `drag` numbers the particle that is dragged, `cut` has the ends of a cut, `key` is a key to change, `fault` the robot that is
// killed, `push` says where an obstacle is taken and how far it goes, `squeeze` that the slider is moved, `load` has the particle
// whose edge is loaded, `design` says what a designer does, `node` the leader of a node that is dragged, `first` the particle and
// `follower` the robot that are dragged in a session that stands still as it began. FLOCKFORM_PICTURES is a folder for screenshots.

import { join } from "node:path";

import { judge, tour, watched } from "../common/browser.mjs";

const [address, asked] = [process.argv[2], JSON.parse(process.argv[3] ?? "{}")];
const pictures = process.env.FLOCKFORM_PICTURES;

const seen = {};

const mark = (what) => process.env.FLOCKFORM_MARKS && console.error(Math.round(performance.now()), what);

async function open(context) {
  const page = await watched(context, seen, 60_000);
  await page.goto(address);
  await page.waitForSelector("body[data-live=open]");
  await page.waitForFunction(() => window.report.live.session.frame);
  return page;
}

const clock = (page) => page.evaluate(() => window.report.bodies[0].animation.times[0]);
// By the clock: a page in the background is not refreshed.
const later = (page, than) =>
  page.waitForFunction((t) => window.report.bodies[0].animation.times[0] > t, than, { polling: 20 });
// Once the session stands still and its last state is drawn.
const settled = (page) =>
  page.waitForFunction(() => {
    const { status } = window.report.live.session;
    return !status.playing && window.report.bodies[0].animation.times[0] === status.clock;
  }, undefined, { polling: 20 });
// Once the dragged particle is higher than this: a hand that still holds it keeps it there.
const lifted = (page, above) =>
  page.waitForFunction(([k, y]) => window.report.bodies[0].dy[k] > y, [asked.drag, above], { polling: 20 });
const place = (page, i) => page.evaluate((k) => [window.report.bodies[0].dx[k], window.report.bodies[0].dy[k]], i);

async function shoot(page, name) {
  if (pictures) await page.screenshot({ path: join(pictures, `${name}.png`), fullPage: true });
}

// Where a place of the body, or a particle, is on the screen.
const onScreen = (page, what) =>
  page.evaluate((at) => {
    const [view] = window.report.views;
    const box = view.box.getBoundingClientRect();
    const [x, y] = typeof at === "number" ? view.at(at) : view.place(at);
    return [box.left + x, box.top + y];
  }, what);

// By script: a hand holds the pointer, and what is pressed by it is let go elsewhere.
const play = (page) => page.evaluate(() => document.getElementById("play").click());

async function drag(page, other) {
  // A particle that moves is gone from where it was seen.
  await play(page);
  await settled(page);
  await page.locator(".canvas").scrollIntoViewIfNeeded();
  const before = await place(page, asked.drag);
  const [x, y] = await onScreen(page, asked.drag);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await play(page);
  for (let k = 1; k <= 12; k++) {
    await page.mouse.move(x + 4 * k, y - 3 * k);
    await later(page, await clock(page));
  }
  await lifted(page, before[1] + 0.11);
  await lifted(other, before[1] + 0.06);
  seen.dragged = { before, after: await place(page, asked.drag), there: await place(other, asked.drag) };
  await shoot(page, `${asked.name}-drag`);
  await page.mouse.up();
}

async function cut(page) {
  await page.check("input[name=tool][value=cut]");
  const [from, to] = [await onScreen(page, asked.cut[0]), await onScreen(page, asked.cut[1])];
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move((from[0] + to[0]) / 2, (from[1] + to[1]) / 2, { steps: 4 });
  await page.mouse.move(...to, { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction(() => window.report.bodies[0].brokenBonds() > 0);
  seen.broken = await page.evaluate(() => window.report.bodies[0].brokenBonds());
  await page.check("input[name=tool][value=drag]");
}

async function undo(page) {
  const before = await page.evaluate(() => window.report.live.session.status.clock);
  await page.click("#live-undo");
  await page.waitForFunction(() => window.report.bodies[0].brokenBonds() === 0);
  await settled(page);
  seen.undone = [before, await clock(page)];
}

async function set(page) {
  await page.fill("#live-key", "update.damping=-1");
  await page.press("#live-key", "Enter");
  await page.waitForFunction(() => document.getElementById("live-words").textContent.includes("update.damping"));
  seen.refused = await page.textContent("#live-words");
  seen.alert = await page.evaluate(() => {
    const words = document.getElementById("live-words");
    return [words.getAttribute("role"), words.className, getComputedStyle(words).color];
  });
  await page.fill("#live-key", asked.key);
  await page.press("#live-key", "Enter");
  await page.waitForFunction((key) => window.report.live.session.status.sets.includes(key), asked.key);
  seen.boxes = await boxes(page);
  seen.command = await page.textContent("#command");
}

// Numbers that can be changed, by key.
const boxes = (page) =>
  page.$$eval("#live-numbers input", (inputs) => Object.fromEntries(inputs.map((input) => [input.dataset.key, input.value])));

// Tools that are offered, and what the page says of each.
async function tools(page) {
  seen.hints = {};
  for (const tool of await page.$$("input[name=tool]")) {
    if (!(await tool.isVisible())) continue;
    await tool.check();
    seen.hints[await tool.getAttribute("value")] = await page.textContent("#hint");
  }
  await page.check("input[name=tool][value=drag]");
}

async function fault(page) {
  await play(page);
  await settled(page);
  await page.locator(".canvas").scrollIntoViewIfNeeded();
  const [x, y] = await onScreen(page, asked.fault);
  await page.mouse.click(x, y);
  await page.selectOption("#live-fault", "dead");
  await page.waitForFunction(() => window.report.live.session.status.faults.length > 0);
  seen.hurt = await page.evaluate(() => window.report.live.session.status.faults);
  await play(page);
  await page.fill("#live-key", "flight.noise=0.02");
  await page.press("#live-key", "Enter");
  await later(page, (await clock(page)) + 0.5);
  seen.alarms = await page.$$eval("#live-alarms li", (items) => items.map((item) => item.textContent));
}

// The obstacle's corner is moved by the hand; the page shows where it went.
async function push(page) {
  const { by } = asked.push;
  const from = await onScreen(page, asked.push.at);
  const to = await onScreen(page, asked.push.at.map((along, k) => along + by[k]));
  await page.mouse.move(...from);
  await page.mouse.down();
  for (let k = 1; k <= 10; k++) {
    await page.mouse.move(...from.map((along, axis) => along + ((to[axis] - along) * k) / 10));
    await later(page, await clock(page));
  }
  await page.waitForFunction((x) => window.report.live.session.status.obstacles[0][0] > x, 0.9 * by[0]);
  await shoot(page, `${asked.name}-push`);
  await page.mouse.up();
  seen.pushed = await page.evaluate(() => window.report.live.session.status.obstacles[0]);
}

async function squeeze(page) {
  await page.locator("#live-squeeze").fill("0.8");
  await later(page, (await clock(page)) + 3);
  await shoot(page, `${asked.name}-squeeze`);
  seen.squeezed = await page.evaluate(() => {
    const { X, dx } = window.report.bodies[0];
    const places = [...X].map((x, i) => x + dx[i]);
    return Math.max(...places) - Math.min(...places);
  });
}

async function load(page) {
  await page.check("input[name=tool][value=load]");
  const [x, y] = await onScreen(page, asked.load);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 20, y, { steps: 4 });
  await page.mouse.move(x + 40, y, { steps: 4 });
  await shoot(page, `${asked.name}-load`);
  await page.mouse.up();
  await page.waitForFunction(() => window.report.live.session.status.sets.some((text) => text.startsWith("loads")));
  await later(page, (await clock(page)) + 200);
  seen.loaded = await place(page, asked.load);
  await page.check("input[name=tool][value=drag]");
}

async function pause(page) {
  await page.click("#play");
  await settled(page);
  const before = await clock(page);
  await page.click("#forth");
  await later(page, before);
  await settled(page);
  seen.stepped = (await clock(page)) - before;
}

async function save(page) {
  await page.click("#live-save");
  await page.waitForSelector("body[data-saved]");
  seen.saved = await page.evaluate(() => document.body.dataset.saved);
  seen.clock = await clock(page);
  seen.places = await page.evaluate(() => [[...window.report.bodies[0].dx], [...window.report.bodies[0].dy]]);
}

// The page after the design that begins anew.
async function redesigned(page, act) {
  await page.evaluate(() => (window.isOld = true));
  await act();
  await page.waitForFunction(() => !window.isOld && window.report?.live?.session.frame);
  await page.waitForSelector("body[data-live=open]");
}

// A robot is placed, dragged, linked, named and told to lead; another one is removed, and comes back.
async function design(page) {
  const { at, by, other } = asked.design;
  // From a flight back to the formation.
  await page.click("#play");
  await later(page, 0.2);
  await redesigned(page, () => page.check("input[name=tool][value=place]"));
  await settled(page);
  await page.check("#design-leads");
  await page.locator(".canvas").scrollIntoViewIfNeeded();
  // Beside the formation there is room for another robot once the view is zoomed out.
  for (const _ of [1, 2]) await page.click("#zoom-out");
  await page.waitForFunction(() => window.report.views[0].show.camera === window.report.state.camera);
  const click = async (what) => page.mouse.click(...(await onScreen(page, what)));
  const pull = async (from, to) => {
    await page.mouse.move(...(await onScreen(page, from)));
    await page.mouse.down();
    await page.mouse.move(...(await onScreen(page, to)), { steps: 5 });
    await page.mouse.up();
  };
  await redesigned(page, () => click(at));
  const placed = await page.evaluate(() => window.report.bodies[0].count - 1);
  await redesigned(page, () => pull(placed, at.map((along, k) => along + by[k])));
  await page.check("input[name=tool][value=link]");
  await redesigned(page, () => pull(placed, other));
  await click(placed);
  await page.fill("#design-name [name=name]", "scout");
  await redesigned(page, () => page.click("#design-name button"));
  await redesigned(page, () => page.click("#design-lead"));
  await shoot(page, `${asked.name}-design`);
  seen.exact = await page.$$eval("#design-exact li", (items) => items.map((item) => item.textContent));
  await click(other);
  await redesigned(page, () => page.click("#design-remove"));
  seen.removed = await page.evaluate(() => window.report.bodies[0].count);
  await redesigned(page, () => page.click("#live-undo"));
  await save(page);
}

// Notes frame by frame how far robots are beyond the edge of the view, in their diameters.
const watchEdges = (page) =>
  page.evaluate(() => {
    window.beyond = 0;
    const look = () => {
      const { views: [view], state: { camera, factor, turned } } = window.report;
      const { low, high } = view.bounds([0], factor, turned);
      const room = [view.width, view.height].map((length) => length / camera.scale / 2);
      const own = 2 * Math.max(...view.body.animation.radii);
      [camera.x, camera.y].forEach((middle, k) => {
        window.beyond = Math.max(window.beyond, (middle - room[k] - low[k]) / own, (high[k] - middle - room[k]) / own);
      });
      requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
  });

// The page of a node that takes commands: stopped, resumed, moved by a leader that is dragged.
async function command(page) {
  const mode = (name) => page.waitForFunction((n) => document.getElementById("node-mode").textContent.startsWith(n), name);
  const said = (text) => page.waitForFunction((t) => document.getElementById("live-words").textContent.includes(t), text);
  await page.waitForFunction(() => window.report.live.session.status.faults.length === 0);
  await page.click("#node-stop");
  await mode("emergency stop");
  await shoot(page, `${asked.name}-stop`);
  await page.click("#node-resume");
  await mode("running");
  await page.click("#node-switch");
  await mode("inactive");
  await page.click("#node-switch");
  await mode("running");
  await page.fill("#node-move [name=x]", "9");
  await page.fill("#node-move [name=duration]", "0.1");
  await page.click("#node-move button");
  await said("duration of at least");
  await page.fill("#node-move [name=duration]", "3");
  await page.check("input[name=tool][value=drag]");
  await page.locator(".canvas").scrollIntoViewIfNeeded();
  const [x, y] = await onScreen(page, asked.node);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 60, y - 30, { steps: 5 });
  await page.mouse.up();
  await said("under way for 3 s");
  await watchEdges(page);
  await page.waitForFunction(() => window.report.live.session.status.alarms.length > 0);
  await shoot(page, `${asked.name}-moves`);
  seen.alarms = await page.$$eval("#live-alarms li", (items) => items.map((item) => item.textContent));
  // The program that led them before would go on for longer.
  await later(page, (await clock(page)) + 4);
  const posture = () => page.evaluate(() => JSON.stringify({ ...window.report.live.session.status.node }));
  const before = await posture();
  await later(page, (await clock(page)) + 0.5);
  seen.isThere = (await posture()) === before;
  seen.beyond = await page.evaluate(() => window.beyond);
  seen.isInView = await page.evaluate(() => {
    const { views: [view], state: { camera, factor, turned } } = window.report;
    const { low, high } = view.bounds([0], factor, turned);
    const room = [view.width, view.height].map((length) => length / camera.scale / 2);
    return [camera.x, camera.y].every((middle, k) => low[k] > middle - room[k] && high[k] < middle + room[k]);
  });
}

// Whether the view is large, and all of it and the clock below it in the window, in windows of laptops.
async function windows(page) {
  seen.windows = [];
  for (const [width, height] of [[1366, 657], [1280, 900], [390, 844]]) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(300);
    await shoot(page, `${asked.name}-${width}`);
    seen.windows.push(
      await page.evaluate(() => {
        const [view, clock] = [".canvas", ".transport"].map((of) => document.querySelector(of).getBoundingClientRect());
        const isWide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
        return { high: view.height, below: clock.bottom - window.innerHeight, isWide };
      }),
    );
  }
  await page.setViewportSize({ width: 1280, height: 1000 });
  await page.waitForTimeout(300);
}

const said = (page) => page.textContent("#live-words");
const status = (page) => page.evaluate(() => ({ ...window.report.live.session.status }));
const statusIs = (page, holds, value) =>
  page.waitForFunction(([key, v]) => window.report.live.session.status[key] === v, [holds, value], { polling: 20 });

async function pull(page, particle, by) {
  const [x, y] = await onScreen(page, particle);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + by[0], y + by[1], { steps: 6 });
  return [x + by[0], y + by[1]];
}

// What a reader does first with a body, which stands still.
async function first(page) {
  await windows(page);
  const shown = (to) =>
    page.waitForFunction(([k, [x, y]]) => {
      const [view] = window.report.views;
      const box = view.box.getBoundingClientRect();
      const [u, v] = view.at(k);
      return Math.hypot(box.left + u - x, box.top + v - y) < 1.5;
    }, [asked.first, to], { polling: 20 });
  const before = await place(page, asked.first);
  const to = await pull(page, asked.first, [40, -30]);
  await shown(to);
  await shoot(page, `${asked.name}-held`);
  await page.mouse.up();
  await statusIs(page, "undo", 1);
  await shown(to);
  seen.still = { before, after: await place(page, asked.first), clock: await clock(page) };
  for (const step of [1, 2]) {
    await page.click("#forth");
    await statusIs(page, "clock", step);
    await settled(page);
  }
  seen.still.stepped = await place(page, asked.first);
  await page.keyboard.press("u");
  await statusIs(page, "undo", 0);
  await settled(page);
  seen.still.undone = await place(page, asked.first);
  // Words are those of the last act.
  await page.fill("#live-key", "damping");
  await page.press("#live-key", "Enter");
  seen.words3 = [await said(page)];
  await page.click("#forth");
  await statusIs(page, "clock", 1);
  seen.words3.push(await said(page));
  const damping = page.locator('#live-numbers input[data-key="update.damping"]');
  await damping.fill("");
  await damping.blur();
  seen.emptied = await damping.inputValue();
  await damping.fill("0.8009999999999998");
  await damping.blur();
  await page.waitForFunction(() => window.report.live.session.status.sets.length > 0);
  seen.counted = (await status(page)).sets;
  await save(page);
  await page.keyboard.press(" ");
  await statusIs(page, "playing", true);
  seen.savedOnce = (await said(page)) === "";
  await page.locator("label", { hasText: "look" }).click();
  await page.keyboard.press(" ");
  await statusIs(page, "playing", false);
}

// And with a swarm: a follower does not lead.
async function follower(page) {
  await windows(page);
  await pull(page, asked.follower, [50, 40]);
  await page.waitForFunction(() => document.getElementById("live-words").textContent !== "");
  await page.mouse.up();
  await page.waitForTimeout(300);
  seen.follower = [await said(page), (await status(page)).undo];
  await page.selectOption("#live-fault", "dead");
  seen.follower.push(await said(page), await page.inputValue("#live-fault"));
  const click = async (robot) => page.mouse.click(...(await onScreen(page, robot)));
  await click(asked.follower);
  await page.selectOption("#live-fault", "dead");
  await page.waitForFunction(() => window.report.live.session.status.faults.length > 0);
  seen.follower.push(await said(page));
  const chosen = () => page.$eval("#live-fault", (list) => [document.getElementById("live-chosen").textContent, list.value]);
  await page.waitForTimeout(200);
  seen.chosen = [await chosen()];
  await click(0);
  await page.waitForTimeout(200);
  seen.chosen.push(await chosen());
  const to = await pull(page, 0, [60, 30]);
  await page.waitForFunction(() => window.report.live.session.status.undo === 2);
  seen.target = await page.waitForFunction((at) => {
    const { views: [view], bodies: [body] } = window.report;
    const box = view.box.getBoundingClientRect();
    const [tx, ty] = ["target_dx", "target_dy"].map((name) => body.frames.values.get(name)[0]);
    const [x, y] = view.place([body.X[0] + tx, body.Y[0] + ty]);
    return Math.hypot(box.left + x - at[0], box.top + y - at[1]) < 2;
  }, to).then(() => true);
  await shoot(page, `${asked.name}-held`);
  await page.mouse.up();
  seen.offered = await page.$$eval("#quantity option", (options) => options.map((option) => option.value));
  seen.hint = await page.textContent(".keys");
}

async function everything(page, other) {
  seen.offered = await boxes(page);
  await tools(page);
  await page.click("#play");
  await later(page, 0);
  mark("playing");
  if (asked.drag !== undefined) await drag(page, other);
  mark("dragged");
  if (asked.cut) {
    await cut(page);
    mark("cut");
    await shoot(page, `${asked.name}-cut`);
    await undo(page);
    mark("undone");
    await page.click("#play");
    await cut(page);
    await later(page, (await clock(page)) + 20);
    await shoot(page, `${asked.name}-torn`);
  }
  if (asked.push) await push(page);
  if (asked.squeeze) await squeeze(page);
  if (asked.load !== undefined) await load(page);
  if (asked.key) await set(page);
  if (asked.fault !== undefined) await fault(page);
  await shoot(page, `${asked.name}-end`);
  await pause(page);
  await save(page);
}

await tour("live", seen, async (context) => {
  const other = await open(context);
  const page = await open(context);
  await page.bringToFront();
  if (asked.node !== undefined) await command(page);
  else if (asked.design) await design(page);
  else if (asked.first !== undefined) await first(page);
  else if (asked.follower !== undefined) await follower(page);
  else await everything(page, other);
  seen.words = await page.textContent("#loading");
  await judge(page, seen);
});
