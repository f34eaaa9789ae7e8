// Chromium for tours of pages: started, watched and judged alike.
//
// FLOCKFORM_NODE_MODULES is a folder with playwright-core and axe-core, FLOCKFORM_CHROMIUM another browser.

import { createRequire } from "node:module";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

const modules = join(resolve(process.env.FLOCKFORM_NODE_MODULES ?? "node_modules"), "/");
const { chromium } = createRequire(modules)("playwright-core");
const axe = readFileSync(join(modules, "axe-core/axe.min.js"), "utf8");

const FLAGS = [
  "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
];

// Says as JSON what `work` saw in a browser of its own.
export async function tour(name, seen, work) {
  Object.assign(seen, { errors: [], requests: [], faults: [] });
  const profile = mkdtempSync(join(tmpdir(), `flockform-${name}-`));
  const executablePath = process.env.FLOCKFORM_CHROMIUM ?? "/usr/bin/chromium";
  const options = { executablePath, args: FLAGS, headless: true, viewport: { width: 1280, height: 1000 } };
  const context = await chromium.launchPersistentContext(profile, options);
  try {
    await work(context);
    console.log(JSON.stringify(seen));
  } finally {
    await context.close();
    rmSync(profile, { recursive: true, force: true });
  }
}

// A page whose errors and requests are noted.
export async function watched(context, seen, patience) {
  const page = await context.newPage();
  page.setDefaultTimeout(patience);
  page.on("console", (message) => message.type() === "error" && seen.errors.push(message.text()));
  page.on("pageerror", (error) => seen.errors.push(error.message));
  page.on("request", (request) => seen.requests.push(request.url().slice(0, 100)));
  return page;
}

// Notes what is a serious hindrance to readers of any kind, in both themes.
export async function judge(page, seen) {
  // Not as a script of the page, which may forbid others than its own.
  await page.evaluate(axe);
  for (const theme of ["light", "dark"]) {
    await page.evaluate((name) => (document.documentElement.dataset.theme = name), theme);
    await page.evaluate(() => new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go))));
    const result = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
    const serious = result.violations.filter((one) => one.impact === "serious" || one.impact === "critical");
    seen.faults.push(...serious.map((one) => `${theme}: ${one.id}: ${one.nodes.map((node) => node.target).join(" ")}`));
  }
}
