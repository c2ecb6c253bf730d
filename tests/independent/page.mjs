// Operates a machine through the live page as a person does; see page.sh.

import { createRequire } from "node:module";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Machine } from "./page_machine.mjs";

const [folder, graver, machineFile] = process.argv.slice(2);
const require = createRequire(join(folder, "package.json"));
const puppeteer = require("puppeteer-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const chromium = process.env.CHROMIUM ?? "/usr/bin/chromium";
const pictures = process.env.PICTURES;

/** A square of 20 mm, marked eight times: long enough to be held. */
const PROGRAM = ["G21 G90 F3000", "M4 S500", ...Array(8).fill("G1 X20\nG1 Y20\nG1 X0\nG1 Y0"), "M5", ""].join("\n");
const BAD_PROGRAM = "G21 G90 F1000\nM4 S500\nG1 X5\nG1 X15000\nM5\n";

let failures = 0;
const wait = (time) => new Promise((resolve) => setTimeout(resolve, time));

function found(isGood, what) {
  if (!isGood) failures += 1;
  console.log(`${isGood ? "good " : "WRONG"}  ${what}`);
}

/** Waits until the page says so, and says it if it does not. */
async function until(page, what, condition, ...values) {
  try {
    await page.waitForFunction(condition, { timeout: 20_000 }, ...values);
    found(true, what);
    return true;
  } catch {
    const state = await page.evaluate(() => `${document.body.dataset.state}: ${document.getElementById("state-cause").textContent}; ${[...document.querySelectorAll(".note")].map((it) => it.textContent).filter(Boolean).join("; ")}`);
    found(false, `${what} (the page says ${state})`);
    return false;
  }
}

const stateIs = (page, state) => until(page, `the state is ${state}`, (it) => document.body.dataset.state === it, state);
const text = (page, selector) => page.$eval(selector, (element) => element.textContent);
const view = async (page, name) => {
  await page.click(`#tab-${name}`);
  await wait(300);
};
/** Where an axis is, as the page says it [mm]. */
const position = async (page, axis) => parseFloat((await text(page, `tr[data-axis="${axis}"] td:nth-child(2)`)).replace("\u2212", "-"));

async function picture(page, name) {
  if (pictures) await page.screenshot({ path: join(pictures, `${name}.png`) });
}

async function upload(page, name, program) {
  const path = join(folder, name);
  writeFileSync(path, program);
  await (await page.$("#file")).uploadFile(path);
  await page.waitForFunction((it) => document.getElementById("job-title").textContent === it, { timeout: 20_000 }, name);
}

async function connects(page) {
  await until(page, "the page is connected", () => document.body.dataset.link === "open" && document.body.dataset.role === "operate");
  await until(page, "it shows a state", () => document.body.dataset.state !== "unknown");
}

async function becomesIdle(page) {
  if (await page.evaluate(() => document.body.dataset.state === "disabled")) await page.click('.verbs [data-verb="enable"]');
  await stateIs(page, "idle");
}

async function marks(page) {
  await view(page, "jobs");
  await upload(page, "bad.ngc", BAD_PROGRAM);
  await until(page, "a job that is not possible is told with file and line", () => /bad\.ngc:4/.test(document.getElementById("check-result").textContent));
  console.log(`       ${await text(page, "#check-result")}`);
  await upload(page, "square.ngc", PROGRAM);
  await until(page, "a job that is possible is told with its time", () => document.querySelector("#check-result .check-word.good") && /time[\d:]/.test(document.getElementById("check-result").textContent.replace(/\s/g, "")));
  console.log(`       ${await text(page, "#check-result .check-facts")}`);
  await picture(page, "jobs");
  await page.click("#job-submit");
  await until(page, "it is in the queue", () => /No\. \d+/.test(document.getElementById("submit-note").textContent));
  await view(page, "operate");
  await stateIs(page, "running");
  await wait(1500);
  await picture(page, "machine");
  await page.click("#hold");
  await stateIs(page, "holding");
  await wait(500);
  const before = await text(page, "#tool-place");
  await wait(500);
  found(before === await text(page, "#tool-place"), `it stands at ${before}: ${await text(page, "#state-cause")}`);
  await page.click("#resume");
  await stateIs(page, "running");
  await page.keyboard.press("Escape");
  await stateIs(page, "holding");
  await page.keyboard.down("Shift");
  await page.keyboard.press("KeyR");
  await page.keyboard.up("Shift");
  await stateIs(page, "running");
  await until(page, "the job is completed", () => /square.*completed/.test(document.getElementById("queue").textContent));
  await until(page, "the history has its report", () => document.querySelector('#history a[href$="report.html"]') !== null);
  const report = await page.evaluate(async () => (await fetch(document.querySelector('#history a[href$="report.html"]').href)).status);
  found(report === 200, `the report is served (${report})`);
}

async function jogs(page) {
  await view(page, "operate");
  await becomesIdle(page);
  const from = await position(page, "x");
  await page.select("#jog-step", "1");
  await page.click('[aria-label="Jog x plus"]');
  await until(page, "a step moves x by 1 mm", (it) => Math.abs(parseFloat(document.querySelector('tr[data-axis="x"] td:nth-child(2)').textContent) - it - 1) < 0.02, from);
  await page.select("#jog-step", "on");
  await stateIs(page, "idle");
  const start = await position(page, "x");
  const box = await (await page.$('[aria-label="Jog x plus"]')).boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await stateIs(page, "jogging");
  await wait(700);
  await page.mouse.up();
  await stateIs(page, "idle");
  const end = await position(page, "x");
  found(end > start + 5 && end < start + 60, `pressed for 0.7 s at 20 mm/s and more, x went from ${start} to ${end} mm`);
  await page.evaluate(() => document.querySelector("details.card").setAttribute("open", ""));
  await page.$eval("#pulse-power", (element) => (element.value = "50"));
  await page.$eval("#pulse-form", (form) => (form.noValidate = true));
  await page.click("#pulse-arm");
  await page.click("#pulse-fire");
  await until(page, "a test pulse that is too strong is refused in words", () => /%/.test(document.getElementById("pulse-note").textContent) && document.getElementById("pulse-note").dataset.kind === "refused");
  console.log(`       ${await text(page, "#pulse-note")}`);
}

async function scopes(page) {
  await view(page, "scope");
  await until(page, "the scope shows pictures", () => !/waits|off/.test(document.getElementById("scope-state").textContent));
  await page.click("#scope-single");
  await until(page, "a single picture is taken", () => /taken/.test(document.getElementById("scope-state").textContent));
  await page.click("#scope-cursors");
  await until(page, "cursors measure", () => /Δt/.test(document.getElementById("scope-delta").textContent) && [...document.querySelectorAll(".trace b")].some((it) => /\d/.test(it.textContent)));
  await picture(page, "scope");
  const saved = await page.evaluate(async () => {
    let blob = null;
    const { createObjectURL } = URL;
    URL.createObjectURL = (it) => createObjectURL.call(URL, (blob = it));
    document.getElementById("scope-save").click();
    URL.createObjectURL = createObjectURL;
    return blob.text();
  });
  const lines = saved.trim().split("\n");
  const columns = new Set(lines.map((line) => line.split(",").length));
  found(/^time \[s\],/.test(saved) && lines.length > 100 && columns.size === 1, `the picture is saved: ${lines.length} lines, ${lines[0]}`);
  await view(page, "latency");
  await until(page, "latencies are shown", () => document.querySelectorAll(".hop").length > 3);
  await wait(1200);
  await picture(page, "latency");
}

async function isAccessible(page) {
  for (const scheme of ["light", "dark"]) {
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
    for (const name of ["operate", "jobs", "scope", "latency", "events"]) {
      await view(page, name);
      await page.evaluate(axe);
      const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
      const bad = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
      const words = violations.map(({ id, impact, nodes }) => `${impact} ${id}: ${nodes.slice(0, 3).map((node) => node.target.join(" ")).join(", ")}`);
      found(bad.length === 0, `axe, ${name}, ${scheme}: ${words.length ? words.join("; ") : "nothing"}`);
    }
  }
  await page.emulateMediaFeatures([]);
}

async function isOnPhones(browser, address) {
  const page = await browser.newPage();
  await page.setViewport({ width: 360, height: 740, isMobile: true, hasTouch: true });
  await page.goto(address);
  await connects(page);
  for (const name of ["operate", "jobs", "scope", "latency", "events"]) {
    await view(page, name);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    found(wide <= 360, `${name} is ${wide} pixels wide on a phone`);
  }
  await view(page, "operate");
  await wait(500);
  await picture(page, "phone");
  await page.close();
}

async function reconnects(page, machine) {
  await machine.crash();
  await until(page, "a lost connection is told", () => !document.getElementById("banner").hidden);
  found(await page.$eval("#stop", (it) => it.disabled), "what operates is locked without a connection");
  await machine.serve(machine.address);
  await until(page, "the page finds the server again", () => document.getElementById("banner").hidden && !document.getElementById("stop").disabled);
}

const browser = await puppeteer.launch({ executablePath: chromium, args: ["--no-sandbox"], userDataDir: join(folder, "profile") });
const given = process.env.GRAVER_PAGE;
let machine = null;
try {
  if (pictures) mkdirSync(pictures, { recursive: true });
  if (!given) machine = await Machine.start(graver, machineFile, folder);
  const address = given ?? machine.page;
  const page = await browser.newPage();
  await page.setViewport({ width: 1400, height: 900 });
  const problems = [];
  page.on("pageerror", (error) => problems.push(error.stack ?? String(error)));
  page.on("console", (message) => {
    if (message.type() === "error" && !/WebSocket|ERR_CONNECTION/.test(message.text())) problems.push(`${message.text()} ${message.location()?.url ?? ""}`);
  });
  await page.goto(address);
  await connects(page);
  await becomesIdle(page);
  await marks(page);
  await jogs(page);
  await scopes(page);
  await isAccessible(page);
  await isOnPhones(browser, address);
  if (machine) await reconnects(page, machine);
  found(problems.length === 0, `the browser's console: ${problems.length ? problems.join("\n       ") : "nothing"}`);
} finally {
  await browser.close();
  await machine?.end();
}
console.log(failures ? `${failures} wrong` : "all good");
process.exitCode = failures ? 1 : 0;
