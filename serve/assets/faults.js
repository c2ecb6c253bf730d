// Faults: the latched one above all views, and those of before, each with what to do about it as the server says.

import { byId, make, setText, show } from "./dom.js";
import { http, on } from "./connection.js";
import { entry } from "./events.js";
import { inWords } from "./status.js";

/** What to do about a fault, by its code. */
const advice = new Map();

/** A fault in words; its code stands before them where they do not begin with it. */
function told({ code, detail }) {
  return inWords(!detail || detail.startsWith(code) ? detail || code : `${code}: ${detail}`);
}

function showLatched({ fault, faults }) {
  show(byId("fault"), Boolean(fault));
  if (!fault) return;
  const newest = faults?.at(-1);
  const isThis = newest && fault.startsWith(newest.code);
  setText(byId("fault-text"), isThis ? told(newest) : inWords(fault));
  setText(byId("fault-advice"), advice.get(isThis ? newest.code : fault) ?? "");
}

function showAll(faults) {
  const items = [...faults].reverse().map((fault) =>
    entry("fault", fault.time, told(fault), fault.advice ?? advice.get(fault.code), fault.job ? `in ${fault.job}` : ""));
  byId("faults").replaceChildren(...(items.length ? items : [make("li", { class: "dim" }, "No faults.")]));
}

/** Shows faults as they come. */
export function startFaults() {
  let shown = null;
  let latest = null;
  on("status", async ({ status }) => {
    latest = status;
    showLatched(status);
    const newest = status.faults?.at(-1);
    const key = newest ? `${newest.time} ${newest.code} ${status.faults.length}` : "none";
    if (key === shown) return;
    shown = key;
    showAll(status.faults ?? []);
    if (!newest) return;
    try {
      const faults = await http("GET", "faults");
      for (const fault of faults) if (fault.advice) advice.set(fault.code, fault.advice);
      showAll(faults);
      showLatched(latest);
    } catch {
      // Those of the status are shown, without advice.
    }
  });
}
