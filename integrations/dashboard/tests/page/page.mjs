// The page as a person uses it, and a stranger's page: page.mjs CHROMIUM ADDRESS PROCESS [FOLDER FOR PICTURES] [PICTURE]. Called by
// `check`.
import { chromium } from "playwright-core";
import assert from "node:assert/strict";
import http from "node:http";

const [executablePath, url, robot, shots, picture] = process.argv.slice(2);
const port = new URL(url).port, VIEWS = ["overview", "plots", "joints", "topics", "events", "graph", "scene"];
const quiet = ["--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run", "--disable-quic"];
const browser = await chromium.launch({ executablePath, headless: true, args: ["--no-sandbox", "--enable-unsafe-swiftshader", ...quiet, "--host-resolver-rules=MAP evil.example 127.0.0.1"] });
const said = [];
const passed = (what) => console.log(`page: ${what}`);

async function open(address, { width = 1280, height = 800, colorScheme = "light" } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme });
  const page = await context.newPage();
  page.on("console", (message) => said.push(message.text()));
  page.on("pageerror", (error) => said.push(error.message));
  page.requested = [];
  page.on("request", (request) => page.requested.push(request.url()));
  const bodies = [];
  page.on("response", (response) => bodies.push(response.body().catch(() => "")));
  page.loaded = async () => (await Promise.all(bodies)).reduce((sum, body) => sum + body.length, 0);
  const start = Date.now();
  await page.goto(address);
  await page.waitForFunction(() => window.dashboard?.robot.report && window.dashboard.stat.frames > 2);
  page.ready = Date.now() - start;
  return page;
}
const text = (page, selector) => page.textContent(selector);
const until = (page, selector, wanted) => page.waitForFunction(([selector, wanted]) => document.querySelector(selector)?.textContent.includes(wanted), [selector, wanted]);
const tab = (page, view) => page.click(`#tab-${view}`);
const parameter = (name) => `[data-parameter="param/${name}"]`;
const command = (name) => `[data-command="command/${name}"]`;

// The first load.
const page = await open(url);
const bytes = await page.loaded();
assert.ok(page.requested.length <= 8, `${page.requested.length} requests`);
assert.deepEqual(page.requested.filter((request) => !request.startsWith(`http://127.0.0.1:${port}/`)), []);
assert.ok(bytes <= 1e6, `${bytes} bytes`);
assert.equal(page.url(), `http://127.0.0.1:${port}/`, "the token does not stay in the address");
passed(`ready after ${page.ready} ms, ${page.requested.length} requests, ${bytes} bytes`);

if (picture) {
  await page.fill("[data-command=\"command/look\"] input", "9");
  await page.click("[data-command=\"command/look\"] button");
  // For longer than a moment.
  await page.waitForFunction(() => window.dashboard.robot.report.problems.some((problem) => problem.severity === "lost" && window.dashboard.robot.report.time - problem.since > 2));
  await page.evaluate(() => { scrollTo(0, 0); document.activeElement.blur(); });
  await page.screenshot({ path: picture });
  await browser.close();
  process.exit();
}

// A refusal is told where it was asked for, in the robot's words, and what was typed stays.
await page.fill(`${parameter("radius")} input[type=number]`, "99");
await page.press(`${parameter("radius")} input[type=number]`, "Enter");
await until(page, `${parameter("radius")} .error`, "expected a number in 0.5..=10.0 m, found `99.0`");
await page.fill(`${parameter("radius")} input[type=number]`, "3.5");
await page.press(`${parameter("radius")} input[type=number]`, "Enter");
await until(page, `${parameter("radius")} .value`, "3.5 m");
assert.equal(await text(page, `${parameter("radius")} .error`), "");
await page.focus(`${parameter("nearest")} input[type=range]`);
await page.keyboard.press("End");
await until(page, `${parameter("nearest")} .value`, "2 m");
await page.check(`${parameter("lights")} input`);
await until(page, `${parameter("lights")} .value`, "true");
passed("parameters are set, and refused with the reason");

// A robot's text is text.
const html = "<img src=x onerror=\"window.broken = true\">";
await page.fill(`${parameter("mission")} input`, html);
await page.press(`${parameter("mission")} input`, "Enter");
await until(page, `${parameter("mission")} .value`, html);
await tab(page, "events");
await page.waitForFunction((html) => [...document.querySelectorAll("#event-list p")].some((line) => line.textContent.includes(JSON.stringify(html))), html);
assert.equal(await page.evaluate(() => window.broken), undefined);
assert.equal(await page.locator("main img").count(), 0);
passed("HTML in texts is shown as text");

// Events: filter and pause.
await page.fill("#event-filter", "mission");
await page.waitForFunction(() => [...document.querySelectorAll("#event-list li")].every((line) => line.textContent.includes("mission")));
await page.fill("#event-filter", "");
assert.match(await text(page, "#event-list li time"), /^\d\d:\d\d:\d\d\.\d{3}$/);
const wall = await page.evaluate(() => window.dashboard.views.events.map((event) => Math.abs(event.date - Date.now())));
assert.ok(wall.length > 0 && Math.max(...wall) < 600_000, "the time of day is that of the wall");
await page.click("#event-pause");
const held = await page.locator("#event-list li").count();
await tab(page, "overview");
await page.fill(`${parameter("gaze")} input[type=number]`, "0.25");
await page.press(`${parameter("gaze")} input[type=number]`, "Enter");
await until(page, `${parameter("gaze")} .value`, "0.25 rad (14.32°)");
await tab(page, "events");
await page.waitForTimeout(300);
assert.equal(await page.locator("#event-list li").count(), held, "nothing moves while it is paused");
await page.click("#event-pause");
await page.waitForFunction((held) => document.querySelectorAll("#event-list li").length > held, held);
await tab(page, "overview");
passed("events are filtered and held");

// A command has no timeout of the page's own, shows that it runs, and another viewer cancels it.
await page.waitForFunction(() => window.dashboard.robot.report.safety === "armed");
await page.fill(`${command("look")} input[name=times]`, "9");
await page.click(`${command("look")} button`);
await until(page, "#executions", "command/look");
await until(page, "#executions", "share 0");
assert.equal(await page.inputValue(`${command("look")} input[name=times]`), "9", "what was typed stays");
const other = await open(url);
await until(other, "#executions", "started by page 1");
await other.click("#executions .line:has-text(\"command/look\") button");
await until(page, `${command("look")} .error`, "cancelled");
await page.waitForFunction(() => !document.querySelector("#executions").textContent.includes("command/look"));
await other.context().close();
// The browser refuses what is out of the range that the argument states; the robot would do so too.
await page.fill(`${command("travel")} input[name=distance]`, "1000");
await page.click(`${command("travel")} button`);
assert.equal(await page.evaluate((selector) => document.querySelector(selector).validity.rangeOverflow, `${command("travel")} input[name=distance]`), true);
await page.evaluate((selector) => { document.querySelector(selector).noValidate = true; document.querySelector(`${selector} input[name=distance]`).value = "1000"; }, command("travel"));
await page.click(`${command("travel")} button`);
await until(page, `${command("travel")} .error`, "distance: expected a number from 0 to 100, found 1000");
passed("commands run, are cancelled by another viewer, and are refused with the reason");

// Plots move, at a rate of their own.
await tab(page, "plots");
await page.selectOption("#plot-topic", "sensor/base/wheels");
await page.waitForFunction(() => document.querySelector("#plot-field").options.length > 1);
await page.click("#plot-form button[type=submit]");
const before = await page.evaluate(() => ({ ...window.dashboard.stat, time: performance.now() }));
await page.waitForTimeout(3000);
const after = await page.evaluate(() => ({ ...window.dashboard.stat, time: performance.now() }));
assert.ok(after.drawn > before.drawn && after.messages > before.messages);
const rate = (name) => ((after[name] - before[name]) / (after.time - before.time) * 1000).toFixed(1);
passed(`plots: ${rate("frames")} frames/s, ${rate("drawn")} drawings/s, ${(rate("bytes") / 1000).toFixed(1)} kB/s`);

// Joints follow their sliders.
await tab(page, "joints");
await page.focus("[aria-label=\"mast, target\"]");
await page.keyboard.press("End");
await page.waitForFunction(() => window.dashboard.robot.joints.mast.position[0] > 0.5);
passed("a joint follows its slider");

// In three dimensions, loaded when it is asked for.
const asked = page.requested.length;
await tab(page, "scene");
await page.waitForFunction(() => window.dashboard.views.scene?.drawn > 3 && window.dashboard.views.scene.trail.length > 1);
const dish = () => page.evaluate(() => {
  let vertices = 0;
  window.dashboard.views.scene.robot.traverse((part) => { if (part.name === "package://live/dish.stl") vertices += part.geometry.getAttribute("position").count; });
  return vertices;
});
await page.waitForFunction(() => window.dashboard.views.scene.robot.getObjectByName("package://live/dish.stl"));
assert.equal(await dish(), 3 * 64, "all triangles of the mesh");
assert.deepEqual(page.requested.slice(asked), [`http://127.0.0.1:${port}/scene.js`, `http://127.0.0.1:${port}/mesh/0`]);
// The grid goes along by whole cells.
await page.waitForFunction(() => {
  const { grid, robot } = window.dashboard.views.scene, of = (axis) => Math.abs(grid.position[axis] - robot.position[axis]);
  return Math.hypot(robot.position.x, robot.position.y) > 0.5 && of("x") <= 0.25 + 1e-9 && of("y") <= 0.25 + 1e-9;
});
assert.ok(await page.loaded() <= 1e6, "all of it is below a megabyte");
const mast = await page.evaluate(() => 2 * Math.atan2(window.dashboard.views.scene.joints.get("mast").quaternion.z, window.dashboard.views.scene.joints.get("mast").quaternion.w));
assert.ok(mast > 0.5, `the camera looks to ${mast} rad`);
passed("the robot is drawn in three dimensions");

// The keyboard alone.
await page.keyboard.press("Tab");
await page.evaluate(() => document.activeElement.blur());
await page.keyboard.press("4");
assert.equal(await page.getAttribute("#tab-topics", "aria-selected"), "true");
await page.keyboard.press("ArrowRight");
assert.equal(await page.getAttribute("#tab-events", "aria-selected"), "true");
await page.keyboard.press("Escape");
await page.keyboard.press("Escape");
await until(page, "#safety", "disarmed");
await page.click("#arm");
await until(page, "#safety", "armed");
passed("views by number, disarmed by Escape twice");

// Without the token: to read, and to disarm.
const reader = await open(`http://127.0.0.1:${port}/`);
assert.ok((await text(reader, "#banner")).includes("You may read"));
assert.ok(await reader.isDisabled("#arm") && await reader.isDisabled(`${command("look")} button`) && await reader.isDisabled(`${parameter("speed")} input[type=range]`));
await reader.click("#disarm");
await until(reader, "#safety", "disarmed");
await reader.context().close();
passed("readers disarm and change nothing");

// Pages of other sites.
const foreign = http.createServer((_, answer) => { answer.setHeader("content-type", "text/html"); answer.end("<!doctype html><title>other</title>"); }).listen(0, "127.0.0.1");
await new Promise((listening) => foreign.on("listening", listening));
for (const host of ["127.0.0.1", "evil.example"]) {
  const stranger = await (await browser.newContext()).newPage();
  await stranger.goto(`http://${host}:${foreign.address().port}/`);
  for (const target of ["127.0.0.1", "evil.example"]) {
    const outcome = await stranger.evaluate((address) => new Promise((done) => {
      const socket = new WebSocket(address);
      socket.onopen = () => done("opened");
      socket.onerror = () => done("refused");
    }), `ws://${target}:${port}/ws`);
    assert.equal(outcome, "refused", `from ${host} to ${target}`);
  }
  await stranger.context().close();
}
const rebound = await (await browser.newContext()).newPage();
assert.equal((await rebound.goto(`http://evil.example:${port}/`)).status(), 403);
await rebound.context().close();
foreign.close();
passed("other ports and host names are refused, 4 of 4 and the page");

// Each view at two widths, light and dark: nothing is wider than the window.
for (const [width, height] of [[1280, 800], [400, 800]]) for (const colorScheme of ["light", "dark"]) {
  const look = await open(url, { width, height, colorScheme });
  for (const view of VIEWS) {
    await tab(look, view);
    if (view === "plots") {
      await look.selectOption("#plot-topic", "sensor/base/imu");
      await look.waitForFunction(() => document.querySelector("#plot-field").options.length > 1);
      await look.click("#plot-form button[type=submit]");
      await look.waitForFunction(() => window.dashboard.views.plots[0].plot.points.length > 3);
    }
    if (view === "scene") await look.waitForFunction(() => window.dashboard.views.scene?.drawn > 3);
    if (view === "topics") await look.click("#topic-table tbody tr");
    await look.waitForTimeout(shots ? 1500 : 100);
    const over = await look.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(over <= 0, `${view} at ${width}: ${over} too wide`);
    if (shots) await look.screenshot({ path: `${shots}/${view}-${width}-${colorScheme}.png` });
  }
  await look.context().close();
}
passed("every view fits 1280 and 400 pixels");

// Nothing of all that has been said to the console, but by the browser on its own pictures of the canvas; what follows is.
assert.deepEqual(said.filter((line) => !/evil.example|GPU stall due to ReadPixels/.test(line)), []);

// The robot stops answering: the page says so.
process.kill(Number(robot), "SIGKILL");
await until(page, "#banner", "The connection is lost");
assert.ok(await page.isDisabled("#disarm"));
passed("a lost connection is said");
await browser.close();
