// Files: taken by drop or choice, checked and shown where they will be marked, and handed to the queue.

import { byId, make, note, setAttribute, setText, show } from "./dom.js";
import { http, on } from "./connection.js";
import { Drawing, offerOrbit } from "./drawing.js";
import { bytes, duration, fixed, percent } from "./format.js";
import { buildForm, frameSettings, kindOf, readForm, saysPlace, settings } from "./placement.js";
import { announce, attempt, locked, operates, refuse } from "./requests.js";

const LARGEST = 64 * 1024 * 1024;
/** How long nothing is typed before a job is checked again [ms]. */
const PAUSE = 500;
/** How often a plan is asked for while the server is busy. */
const TRIES = 60;

const files = new Map();
let chosen = null;
let preview = null;
let asked = 0;
let pause = 0;
/** Takes how far the drawing was dragged in the preview [m]. */
let placed = null;

async function upload(file) {
  const noteElement = byId("upload-note");
  if (file.size > LARGEST) {
    refuse(noteElement, `${file.name} has ${bytes(file.size)}: 64 MiB at most`);
    return;
  }
  note(noteElement, `${file.name} is uploaded…`);
  await attempt(noteElement, async () => {
    const reply = await http("POST", `jobs?name=${encodeURIComponent(file.name)}`, file, "application/octet-stream");
    const text = /\.toml$/i.test(file.name) ? await file.text() : "";
    files.set(reply.id, { id: reply.id, name: reply.name, size: file.size, kind: kindOf(file.name, text), values: {} });
    note(noteElement, "");
    choose(reply.id);
  });
}

async function remove(id) {
  if (await attempt(byId("upload-note"), async () => {
    await http("DELETE", `jobs/${id}`);
    return true;
  })) {
    files.delete(id);
    if (chosen === id) choose(null);
    else showFiles();
  }
}

function showFiles() {
  byId("files").replaceChildren(...[...files.values()].reverse().map((file) => {
    const pick = make("button", { class: "pick", type: "button", onclick: () => choose(file.id) }, file.name);
    const drop = operates(make("button", { class: "small", type: "button", "aria-label": `Remove ${file.name}`, onclick: () => remove(file.id) }, "✕"));
    const item = make("li", {}, make("div", { class: "line" }, pick, make("small", {}, bytes(file.size)), drop));
    if (file.id === chosen) setAttribute(item, "aria-current", "true");
    return item;
  }));
}

function choose(id) {
  chosen = id;
  const file = files.get(id);
  show(byId("job-card"), Boolean(file));
  show(byId("preview-empty"), !file);
  note(byId("submit-note"), "");
  showFiles();
  preview.setArtwork(null);
  if (!file) {
    byId("check-result").replaceChildren("No job chosen.");
    return;
  }
  setText(byId("job-title"), file.name);
  buildForm(byId("job-form"), file.kind, file.values);
  preview.onPlace = byId("job-form").elements.x ? placed : null;
  preview.isFitted = true;
  check();
}

function fact(name, value) {
  return make("div", {}, make("dt", {}, name), make("dd", {}, value));
}

function showCheck(result) {
  const box = byId("check-result");
  box.className = "";
  if (!result.ok) {
    const { file, line, column, message } = result.error ?? { message: "the check failed" };
    const place = [file?.split("/").pop(), line, column].filter((part) => part !== null && part !== undefined && part !== 0).join(":");
    box.replaceChildren(
      make("p", { class: "check-word bad" }, "✕ Not possible"),
      make("p", { class: "check-place" }, place),
      make("p", {}, message));
    return;
  }
  const mm = (value, axis) => fixed((value?.[axis] ?? NaN) * 1e3, 1);
  const { lower, upper } = result.bounds ?? {};
  const [least, most] = result.power ?? [0, 0];
  const said = (it) => (typeof it === "string" ? it : it.line ? `line ${it.line}: ${it.text}` : it.text);
  box.replaceChildren(
    make("p", { class: "check-word good" }, result.warnings?.length ? "✓ Possible, with warnings" : "✓ Ready to mark"),
    make("dl", { class: "check-facts" },
      fact("time", duration(result.time)), fact("strokes", String(result.strokes)), fact("length", `${fixed(result.length * 1e3, 1)} mm`),
      fact("power", most === 0 ? "never lit" : least === most ? percent(most) : `${percent(least)} to ${percent(most)}`),
      ...(lower ? ["x", "y", "z"].filter((_, axis) => axis < 2 || upper[2] > lower[2]).map((name, axis) => fact(name, `${mm(lower, axis)} to ${mm(upper, axis)} mm`)) : [])),
    make("ul", { class: "check-notes" },
      ...(result.warnings ?? []).map((text) => make("li", { class: "warning" }, `⚠ ${said(text)}`)),
      ...(result.notes ?? []).map((text) => make("li", {}, said(text)))));
}

/** Keeps and shows where the job lies, from home [m], as long as nobody says it. */
function showPlaced(file, placed) {
  file.placed = placed ?? null;
  ["x", "y"].forEach((name, axis) => {
    const field = byId("job-form").elements[name];
    if (field) field.placeholder = String(Number(((placed?.[axis] ?? 0) * 1e3).toFixed(2)));
  });
}

/** Asks for a plan; while the server plans another one, it is asked again. */
async function planned(path, set, isWanted) {
  for (let tries = 0; ; tries++) {
    try {
      return await http("POST", path, { set });
    } catch (error) {
      if (error.status !== 429 || tries >= TRIES || !isWanted()) throw error;
    }
    await new Promise((resolve) => setTimeout(resolve, PAUSE));
  }
}

/** Checks the chosen job and shows where it lies; an answer that came too late is not shown. */
async function check() {
  const file = files.get(chosen);
  if (!file) return;
  const mine = ++asked;
  const isWanted = () => mine === asked;
  const set = settings(file.kind, file.values, file.placed);
  byId("check-result").replaceChildren(make("p", { class: "check-word wait" }, "… Checking"));
  let drawing = null;
  try {
    const result = await planned(`jobs/${file.id}/check`, set, isWanted);
    if (!isWanted()) return;
    showCheck(result);
    if (result.ok && !saysPlace(file.values)) showPlaced(file, result.placed);
    if (result.ok) drawing = await planned(`jobs/${file.id}/preview`, set, isWanted);
  } catch (error) {
    if (isWanted()) showCheck({ ok: false, error: { message: error.message } });
  }
  if (isWanted()) preview.setArtwork(drawing?.strokes?.length ? drawing : null);
}

async function submit(button, extra, what) {
  const file = files.get(chosen);
  if (!file) return;
  const noteElement = byId("submit-note");
  button.setAttribute("aria-busy", "true");
  await attempt(noteElement, async () => {
    const { number } = await http("POST", `jobs/${file.id}/submit`, { set: [...settings(file.kind, file.values, file.placed), ...extra(file.values)] });
    note(noteElement, `${what} is No. ${number} in the queue`, "done");
    announce(`${what} of ${file.name} is number ${number} in the queue`);
  });
  button.removeAttribute("aria-busy");
}

function startDrop() {
  const drop = byId("drop");
  const input = byId("file");
  input.addEventListener("change", () => {
    for (const file of input.files) upload(file);
    input.value = "";
  });
  const view = byId("view-jobs");
  const over = (isOver) => drop.classList.toggle("over", isOver);
  window.addEventListener("dragover", (event) => {
    event.preventDefault();
    over(!view.hidden);
  });
  window.addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) over(false);
  });
  // Dropped anywhere on the page, a file is taken; a browser would leave the page for it.
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    over(false);
    if (locked()) return;
    if (event.dataTransfer.files.length) byId("tab-jobs").click();
    for (const file of event.dataTransfer.files) upload(file);
  });
}

async function list() {
  try {
    // The newest comes first there, and last here.
    for (const { id, name, size } of (await http("GET", "jobs")).reverse()) {
      if (!files.has(id)) files.set(id, { id, name, size, kind: kindOf(name), values: {} });
    }
    showFiles();
  } catch (error) {
    if (error.status !== 403) refuse(byId("upload-note"), error.message);
  }
}

/** Gives the view of jobs its work. */
export function startJobs() {
  preview = new Drawing(byId("preview"));
  startDrop();
  const form = byId("job-form");
  form.addEventListener("input", () => {
    const file = files.get(chosen);
    file.values = readForm(form);
    clearTimeout(pause);
    pause = setTimeout(check, PAUSE);
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  placed = (shift) => {
    const own = files.get(chosen).placed;
    ["x", "y"].forEach((name, axis) => {
      const field = form.elements[name];
      const from = field.value === "" ? (own?.[axis] ?? 0) * 1e3 : Number(field.value);
      field.value = Number((from + shift[axis] * 1e3).toFixed(2));
    });
    form.dispatchEvent(new Event("input"));
  };
  const none = () => [];
  const ways = [
    ["job-submit", none, "The job"],
    ["job-dry", () => ["marking.dry_run=true"], "The dry run"],
    ["job-frame", frameSettings, "The frame"],
  ];
  for (const [id, extra, what] of ways) byId(id).addEventListener("click", () => submit(byId(id), extra, what));
  on("hello", ({ role, machine }) => {
    preview.setArea(machine.area, machine.home);
    offerOrbit(preview, Boolean(machine.is_spatial));
    if (role === "operate") list();
  });
  window.addEventListener("viewshown", () => preview.request());
}
