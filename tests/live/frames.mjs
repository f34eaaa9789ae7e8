// Frames a second of a live page at the program's address, as JSON: one measurement for each quantity.
//
//   node frames.mjs ADDRESS MILLISECONDS QUANTITY...
//
// The page is one that playwright does not watch: it copies every message of a socket that it watches, 1 MB for a frame of
// 10^5 particles, which took two thirds of a page's frames. FLOCKFORM_NODE_MODULES is a folder with playwright-core.

import { createRequire } from "node:module";
import { join, resolve } from "node:path";

const modules = join(resolve(process.env.FLOCKFORM_NODE_MODULES ?? "node_modules"), "/");
const { chromium } = createRequire(modules)("playwright-core");
const [address, milliseconds, ...quantities] = process.argv.slice(2);

const executablePath = process.env.FLOCKFORM_CHROMIUM ?? "/usr/bin/chromium";
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
try {
  const client = await browser.newBrowserCDPSession();
  const { targetId } = await client.send("Target.createTarget", { url: address, width: 1280, height: 1087 });
  const { sessionId } = await client.send("Target.attachToTarget", { targetId, flatten: false });
  const answers = [];
  client.on("Target.receivedMessageFromTarget", ({ message }) => {
    const { id, result } = JSON.parse(message);
    answers[id]?.(result.result.value);
  });
  const evaluate = (expression) =>
    new Promise((take) => {
      const id = answers.push(take) - 1;
      const params = { expression, returnByValue: true };
      client.send("Target.sendMessageToTarget", { sessionId, message: JSON.stringify({ id, method: "Runtime.evaluate", params }) });
    });
  const pause = (time) => new Promise((go) => setTimeout(go, time));
  const isTrue = async (expression) => {
    for (let k = 0; k < 300; k++) {
      if (await evaluate(expression)) return;
      await pause(100);
    }
    throw new Error(`never: ${expression}`);
  };
  await isTrue("document.body?.dataset.live === 'open' && Boolean(window.report.live.session.frame)");
  await evaluate("document.getElementById('play').click()");
  const seen = [];
  for (const quantity of quantities) {
    await evaluate(`{
      const choice = document.getElementById("quantity");
      choice.value = ${JSON.stringify(quantity)};
      choice.dispatchEvent(new Event("change"));
    }`);
    await pause(Number(milliseconds));
    await isTrue("window.report.live.measured.rate > 0");
    const words = await evaluate("document.getElementById('loading').textContent");
    const { measured, rates } = JSON.parse(
      await evaluate("JSON.stringify({ measured: window.report.live.measured, rates: window.report.live.session.status.rates })"),
    );
    seen.push({ quantity, words, measured, rates });
  }
  console.log(JSON.stringify(seen));
} finally {
  await browser.close();
}
