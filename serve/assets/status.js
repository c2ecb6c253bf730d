// State and cause in words, how far the job is, and the readings under the drawing.

import { byId, make, setAttribute, setText } from "./dom.js";
import { on } from "./connection.js";
import { duration, percent, place, speed } from "./format.js";
import { announce } from "./requests.js";

const WORDS = {
  disabled: "Disabled", enabling: "Enabling", idle: "Idle", running: "Running", holding: "Holding", stopping: "Stopping",
  faulted: "Faulted", homing: "Homing", jogging: "Jogging", probing: "Probing", pulsing: "Test pulse", halted: "Halted",
  preparing: "Preparing",
};

const CAUSES = {
  disabled: "Motors without power", enabling: "Motors are powered, axes come to rest", idle: "Ready",
  running: "", holding: "Held", stopping: "To rest, then the job is given up", homing: "Axes look for their references",
  jogging: "Moved by hand", probing: "Moves until the probe touches", pulsing: "The laser is lit for a moment",
  halted: "Stopped by the emergency stop", faulted: "", preparing: "The job is planned",
};

const ENDS = {
  stopped: "the last motion by hand was stopped", soft_limit: "the last motion ended at its soft limit",
  dead_man: "the last jog ended for want of a word from who asked", door_open: "the last motion ended because the door is open",
  interlock: "the last motion ended because of the interlock", not_touched: "the probe did not touch",
  out_of_reach: "the last motion ended where the machine does not reach", fault: "the last motion ended with a fault",
};

/** States of a motion by hand: Esc stops these. */
export const BY_HAND = ["homing", "jogging", "probing", "pulsing"];

let latest = null;

/** The newest status; null before the first. */
export function status() {
  return latest;
}

/** A code at the beginning of a text as words: "emergency_stop" is "emergency stop". */
export function inWords(text) {
  return text.replace(/^[a-z_]+/, (code) => code.replaceAll("_", " "));
}

function causeOf(now) {
  if (now.cause) return now.cause;
  if (now.state === "faulted" || now.state === "halted") return now.fault ? inWords(now.fault) : CAUSES[now.state];
  if (now.state === "idle" && now.unhomed?.length) return `Not homed: ${now.unhomed.join(", ")}`;
  if (now.state === "idle" && now.planner === "planning") return "Planning the job";
  if (now.state === "running") return now.lit ? "Marking" : "In the dark, on the way to the next stroke";
  return CAUSES[now.state] ?? "";
}

function shareDone(now) {
  if (now.elapsed > 0 && Number.isFinite(now.time_left)) return now.elapsed / (now.elapsed + now.time_left);
  return now.samples > 0 ? now.played / now.samples : 0;
}

function showHeader(now) {
  const word = WORDS[now.state] ?? now.state;
  const cause = causeOf(now);
  if (document.body.dataset.state !== now.state) {
    document.body.dataset.state = now.state;
    announce(`${word}. ${cause}`, now.state === "faulted" || now.state === "halted");
  }
  setText(byId("state-word"), word);
  setText(byId("state-cause"), cause);
  setAttribute(document.body, "data-job", now.job ? "" : null);
  setText(byId("job-name"), now.job ? (now.job_number ? `No. ${now.job_number}  ${now.job}` : now.job) : "");
  const share = Math.min(1, Math.max(0, shareDone(now)));
  byId("job-progress").value = share;
  setText(byId("job-percent"), now.job ? percent(share) : "");
  document.title = now.job ? `${percent(share)} ${word} – ${now.job}` : `${word} – Graver`;
}

function showReadings(now) {
  const isJob = Boolean(now.job);
  setText(byId("read-elapsed"), duration(isJob ? now.elapsed ?? NaN : NaN));
  setText(byId("read-left"), isJob ? duration(now.time_left ?? NaN) : "–");
  setText(byId("read-rate"), percent(now.rate));
  setText(byId("read-speed"), speed(now.speed ?? NaN));
  setText(byId("read-power"), percent(now.power ?? NaN, now.power > 0 && now.power < 0.1 ? 1 : 0));
  setText(byId("read-lit"), now.lit ? "lit" : "dark");
  setAttribute(byId("read-lit"), "data-lit", Boolean(now.lit));
  setText(byId("read-stroke"), isJob || now.stroke ? `${now.stroke}${now.strokes ? ` / ${now.strokes}` : ""}` : "–");
  setText(byId("read-line"), now.line ? String(now.line) : "–");
  const tool = now.tool ?? [];
  const shown = tool[2] === 0 ? tool.slice(0, 2) : tool;
  setText(byId("tool-place"), `${shown.map((value, axis) => `${"xyz"[axis]} ${place(value).replace(" mm", "")}`).join("  ")} mm`);
}

function showPipeline(now) {
  const list = byId("pipeline");
  const rows = [
    ["machine", now.machine_file ?? "built in"],
    ["planner", now.planner],
    ["cycles", `${now.cycles.toLocaleString("en")}, ${now.overruns} late`],
    ...Object.entries(now.services ?? {}).map(([name, pid]) => [name, pid === null ? "does not run" : `pid ${pid}`]),
  ];
  if (list.children.length !== rows.length * 2) {
    list.replaceChildren(...rows.flatMap(() => [make("dt"), make("dd")]));
  }
  rows.forEach(([name, value], index) => {
    setText(list.children[index * 2], name);
    setText(list.children[index * 2 + 1], value);
    list.children[index * 2 + 1].classList.toggle("gone", value === "does not run");
  });
}

/** Says that nothing is known any more, and what was known last. */
function showLost(word) {
  document.body.dataset.state = "lost";
  setText(byId("state-word"), word);
  setText(byId("state-cause"), latest ? `Last known: ${WORDS[latest.state] ?? latest.state}` : "");
  document.title = `${word} – Graver`;
}

/** Shows every status that comes. */
export function startStatus() {
  on("link", ({ open }) => {
    if (!open) showLost("No connection");
  });
  on("silent", () => showLost("No pipeline"));
  on("status", ({ status: now }) => {
    latest = now;
    showHeader(now);
    showReadings(now);
    showPipeline(now);
    setText(byId("motion-end"), ENDS[now.motion_end] ?? "");
  });
}
