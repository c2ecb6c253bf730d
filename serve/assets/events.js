// What happened: events as they come, each with advice where the server has some.

import { byId, make, setText, show } from "./dom.js";
import { on } from "./connection.js";
import { clock } from "./format.js";
import { announce } from "./requests.js";
import { inWords } from "./status.js";

const MOST = 300;
const WORDS = { info: "", warning: "⚠ Warning: ", fault: "◆ Fault: " };
let unseen = 0;

/** An item of a log: what happened at a time [s since 1970], and what to do about it. */
export function entry(level, time, text, advice, small) {
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

/** Shows events as they come; those of before the page was opened are no news. */
export function startEvents() {
  const list = byId("events");
  const opened = Date.now();
  const told = new Set();
  list.append(make("li", { class: "dim" }, "Nothing happened yet."));
  on("event", ({ level, text, advice, time }) => {
    // After a lost connection the server tells the newest ones again.
    const key = `${time} ${text}`;
    if (told.has(key)) return;
    if (told.size === 0) list.replaceChildren();
    told.add(key);
    list.prepend(entry(level, time / 1e3, inWords(text), advice));
    while (list.children.length > MOST) list.lastChild.remove();
    if (time <= opened || level === "info") return;
    if (byId("view-events").hidden) {
      unseen += 1;
      count(level === "fault");
    }
    announce(text, level === "fault");
  });
  window.addEventListener("viewshown", (event) => {
    if (event.detail !== "events") return;
    unseen = 0;
    count(false);
  });
}
