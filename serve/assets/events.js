// What happened: events as they come, and the faults that were latched, each with advice.

import { byId, make, setText, show } from "./dom.js";
import { http, on } from "./connection.js";
import { clock } from "./format.js";
import { announce } from "./requests.js";
import { adviceFor, inWords } from "./status.js";

const MOST = 300;
const WORDS = { info: "", warning: "⚠ Warning: ", fault: "◆ Fault: " };
let unseen = 0;

function entry(level, time, text, advice, small) {
  return make("li", { class: `level-${level}` },
    make("time", {}, clock(time)),
    make("div", {}, WORDS[level] ? make("span", { class: "level" }, WORDS[level]) : null, text, small ? make("small", {}, ` ${small}`) : null),
    advice ? make("div", { class: "advice" }, advice) : null);
}

function count(isBad) {
  const element = byId("event-count");
  show(element, unseen > 0);
  setText(element, String(unseen));
  if (isBad) element.classList.add("bad");
  if (unseen === 0) element.classList.remove("bad");
}

/** Shows events and faults as they come. */
export function startEvents() {
  const list = byId("events");
  const faults = byId("faults");
  let isEmpty = true;
  list.append(make("li", { class: "dim" }, "Nothing happened yet."));
  const opened = Date.now();
  const told = new Set();
  on("event", ({ level, text, advice, time }) => {
    // After a lost connection the server tells the newest ones again.
    const key = `${time} ${text}`;
    if (told.has(key)) return;
    told.add(key);
    const isNew = time > opened;
    if (isEmpty) list.replaceChildren();
    isEmpty = false;
    list.prepend(entry(level, time / 1e3, text, advice ?? (level === "fault" ? adviceFor(text) : "")));
    while (list.children.length > MOST) list.lastChild.remove();
    if (isNew && byId("view-events").hidden && level !== "info") {
      unseen += 1;
      count(level === "fault");
    }
    if (isNew && level !== "info") announce(text, level === "fault");
  });
  let shown = null;
  const showFaults = (all) => {
    faults.replaceChildren(...(all.length ? [...all].reverse().map((fault) =>
      entry("fault", fault.time, inWords(fault.detail?.startsWith(fault.code) ? fault.detail : `${fault.code}: ${fault.detail}`),
        fault.advice ?? adviceFor(fault.code), fault.job ? `in ${fault.job}` : "")) : [make("li", { class: "dim" }, "No faults.")]));
  };
  on("status", async ({ status }) => {
    const newest = status.faults?.at(-1);
    const key = newest ? `${newest.time} ${newest.code} ${status.faults.length}` : "none";
    if (key === shown) return;
    shown = key;
    showFaults(status.faults ?? []);
    try {
      showFaults(await http("GET", "faults"));
    } catch {
      // Those of the status are shown.
    }
  });
  window.addEventListener("viewshown", (event) => {
    if (event.detail !== "events") return;
    unseen = 0;
    count(false);
  });
}
