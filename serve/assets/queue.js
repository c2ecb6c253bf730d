// The queue: the job under way, those that wait, and what has been run.

import { byId, make, setText, show } from "./dom.js";
import { http, on } from "./connection.js";
import { clock, duration } from "./format.js";
import { attempt, operates } from "./requests.js";

function action(label, name, work) {
  return operates(make("button", { class: "small operate-only", type: "button", "aria-label": name, title: name, onclick: work }, label));
}

function act(number, verb, body) {
  return () => attempt(byId("queue-note"), async () => {
    byId("queue-note").textContent = "";
    await http("POST", `queue/${number}/${verb}`, body ?? {});
    await refresh();
  });
}

async function refresh() {
  showQueue(await http("GET", "queue"));
}

function described(job) {
  return `No. ${job.number} ${job.name}`;
}

/** How a job is marked otherwise than plainly. */
function manner(job) {
  const set = job.set ?? [];
  if (set.includes("marking.dry_run=true")) return "dry run";
  return set.includes("marking.frame=true") ? "frame" : "";
}

function queueItem(job, index, waiting) {
  const isRunning = index < 0;
  const way = manner(job);
  const line = make("div", { class: "line" },
    make("span", { class: "grow", title: job.file ?? "" }, described(job)),
    way ? make("span", { class: "tag" }, way) : null,
    isRunning || index === 0 ? null : action("↑", `Move ${described(job)} up`, act(job.number, "move", { place: index })),
    isRunning || index === waiting - 1 ? null : action("↓", `Move ${described(job)} down`, act(job.number, "move", { place: index + 2 })),
    action(isRunning ? "Stop" : "✕", `${isRunning ? "Stop" : "Cancel"} ${described(job)}`, act(job.number, "cancel")));
  const when = isRunning ? `under way since ${clock(job.started)}` : index === 0 ? "next" : `waits, place ${index + 1}`;
  return make("li", {}, line, make("small", {}, when));
}

function endedItem(job) {
  const took = job.started && job.ended ? `, ${duration(job.ended - job.started)}` : "";
  return make("li", {},
    make("div", { class: "line" },
      make("span", { class: "grow" }, described(job)),
      manner(job) ? make("span", { class: "tag" }, manner(job)) : null,
      make("span", { class: "outcome", "data-outcome": job.outcome }, job.outcome ?? ""),
      action("↻", `Repeat ${described(job)}`, act(job.number, "repeat"))),
    make("small", {}, `${clock(job.ended)}${took}${job.message ? `: ${job.message}` : ""}`));
}

function showQueue(queue) {
  const { running, waiting = [], ended = [], held = null } = queue ?? {};
  isHeld = held !== null;
  setText(byId("queue-held"), isHeld ? `Held: ${held}` : "");
  setText(byId("queue-hold"), isHeld ? "Start queue" : "Hold queue");
  byId("queue-hold").classList.toggle("primary", isHeld);
  const items = waiting.map((job, index) => queueItem(job, index, waiting.length));
  if (running) items.unshift(queueItem(running, -1));
  if (items.length === 0) items.push(make("li", { class: "dim" }, "Nothing waits."));
  const newest = [...ended].reverse().slice(0, 5);
  byId("queue").replaceChildren(...items, ...newest.map(endedItem));
  const count = waiting.length + (running ? 1 : 0);
  show(byId("queue-count"), count > 0);
  setText(byId("queue-count"), String(count));
}

/** Whether those that wait do not begin. */
let isHeld = false;

const NAMES = { "report.html": "report", "path.svg": "path", "summary.json": "summary", "samples.mcap": "recording" };

function runItem(run) {
  const files = run.files ?? ["report.html", "summary.json", "path.svg"];
  const links = files.filter((file) => NAMES[file]).map((file) =>
    make("a", { href: `/api/v1/runs/${run.n}/${file}`, target: "_blank", rel: "noopener", "aria-label": `${NAMES[file]} of ${run.name}` }, NAMES[file]));
  const facts = [clock(run.started), Number.isFinite(run.time) ? duration(run.time) : "", run.message ?? ""].filter(Boolean).join(", ");
  return make("li", {},
    make("div", { class: "line" }, make("span", { class: "grow" }, run.name), make("span", { class: "outcome", "data-outcome": run.outcome }, run.outcome ?? "")),
    make("small", {}, facts),
    make("div", { class: "row" }, ...links));
}

async function showHistory() {
  await attempt(byId("history-note"), async () => {
    const runs = await http("GET", "runs");
    byId("history-note").textContent = "";
    byId("history").replaceChildren(...(runs.length ? runs.slice(0, 40).map(runItem) : [make("li", { class: "dim" }, "No runs yet.")]));
  });
}

/** Shows the queue whenever it changes, and the history with it. */
export function startQueue() {
  let lastEnded = null;
  byId("queue-hold").addEventListener("click", () => attempt(byId("queue-note"), async () => {
    byId("queue-note").textContent = "";
    showQueue(await http("POST", `queue/${isHeld ? "start" : "hold"}`, {}));
  }));
  on("queue", ({ queue }) => {
    showQueue(queue);
    const newest = queue?.ended?.at(-1)?.number ?? 0;
    if (newest !== lastEnded) showHistory();
    lastEnded = newest;
  });
}
