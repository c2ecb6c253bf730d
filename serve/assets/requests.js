// What an operator asks of the machine. The machine says what is possible: every refusal is shown in its own words
// beside the control that was used. Without a connection, and for who only watches, controls are locked.

import { byId, note, setText } from "./dom.js";
import { http, on } from "./connection.js";
import { percent } from "./format.js";

let isLocked = true;

/** Says something politely, or at once, to who listens to the page. */
export function announce(text, isUrgent = false) {
  setText(byId(isUrgent ? "alarm" : "announcer"), text);
}

/** Whether controls are locked. */
export function locked() {
  return isLocked;
}

/** Makes a control one that operates: it is locked with the others. */
export function operates(element) {
  element.dataset.operates = "";
  element.disabled = isLocked;
  return element;
}

/** Locks or frees every control that operates. */
export function lock(isNow) {
  isLocked = isNow;
  for (const element of document.querySelectorAll("[data-operates]")) element.disabled = isNow;
}

/** Asks for a verb; the note says why not. True where it is accepted. */
export async function ask(verb, body, noteElement, done = "") {
  return attempt(noteElement, async () => {
    const reply = await http("POST", `requests/${verb}`, body ?? {});
    if (!reply.accepted) {
      refuse(noteElement, reply.refusal ?? `refused: ${reply.code ?? "no reason was given"}`);
      return false;
    }
    if (reply.capped_by) note(noteElement, `at ${percent(reply.value)}: ${reply.capped_by}`, "warning");
    else note(noteElement, done, done ? "done" : "");
    return true;
  });
}

/** Says that something was refused, in words. */
export function refuse(noteElement, words) {
  note(noteElement, plain(words), "refused");
}

/** Does something that may fail, with the words of the failure in the note. */
export async function attempt(noteElement, action) {
  try {
    return await action();
  } catch (error) {
    refuse(noteElement, error.message);
    return false;
  }
}

/** What the command line calls `graver reset` is a button here. */
function plain(words) {
  return words.replaceAll("`", "");
}

function bind(button) {
  button.addEventListener("click", async () => {
    const noteElement = byId(button.dataset.note);
    button.setAttribute("aria-busy", "true");
    await ask(button.dataset.verb, {}, noteElement);
    button.removeAttribute("aria-busy");
  });
}

/** Gives the buttons of the page that name a verb their work. */
export function startRequests() {
  for (const button of document.querySelectorAll("button[data-verb]")) bind(button);
  // A refusal of what was asked before is no news once the machine does something else.
  let before = "";
  on("status", ({ status }) => {
    if (status.state === before) return;
    before = status.state;
    for (const element of document.querySelectorAll('.note[data-kind="refused"]')) {
      if (element.closest(".commands, #fault")) note(element, "");
    }
  });
  lock(true);
}
