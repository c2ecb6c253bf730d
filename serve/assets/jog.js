// The jog pad. With a step, a press moves an axis on by it. Continuous, the axis moves while the button or key is
// pressed: the page says so ten times a second over the live connection, and whatever ends the press ends the motion,
// also a lost connection, another window, or a page that is put away. The server stops by itself for want of a word.

import { byId, make, note, setOptions } from "./dom.js";
import { on, send } from "./connection.js";
import { ask, locked, operates, refuse } from "./requests.js";
import { unitScale } from "./format.js";

const INTERVAL = 100;
const STEPS = [["on", "continuous"], [0.01, "0.01"], [0.1, "0.1"], [1, "1"], [10, "10"], [50, "50"]];
const SPEEDS = [1, 5, 20, 50, 100];

let axes = {};
let held = null;

function speedOf(unit) {
  return Number(byId("jog-speed").value) * unitScale(unit).scale;
}

/** Ends a continuous jog, for whatever reason. */
function release() {
  if (!held) return;
  clearInterval(held.timer);
  held.button.classList.remove("moving");
  held = null;
  send({ type: "jog_stop" });
}

function press(button, axis, sign) {
  if (locked() || !axes[axis]) return;
  const { unit } = axes[axis];
  const step = byId("jog-step").value;
  const noteElement = byId("jog-note");
  if (step !== "on") {
    const distance = sign * Number(step) * unitScale(unit).scale;
    ask("step", { axes: [axis], value: distance, second: speedOf(unit), unit }, noteElement);
    return;
  }
  release();
  note(noteElement, "");
  const say = () => {
    if (!send({ type: "jog", axis, speed: sign * speedOf(unit), unit })) release();
  };
  button.classList.add("moving");
  held = { button, timer: setInterval(say, INTERVAL) };
  say();
}

function jogButton(axis, sign, place, arrow) {
  const name = `${axis} ${sign > 0 ? "plus" : "minus"}`;
  const button = operates(make("button", { type: "button", class: place, "aria-label": `Jog ${name}` }, arrow));
  button.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    button.setPointerCapture(event.pointerId);
    press(button, axis, sign);
  });
  for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(type, release);
  // Another button of the pad takes the focus after it was pressed: that is not the end of its press.
  button.addEventListener("blur", () => {
    if (held?.button === button) release();
  });
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("keydown", (event) => {
    if (event.key !== " " && event.key !== "Enter") return;
    event.preventDefault();
    if (!event.repeat) press(button, axis, sign);
  });
  button.addEventListener("keyup", (event) => {
    release();
    if (event.key === " ") event.preventDefault();
  });
  // A press by a switch device or a reader of the screen has no end that could be seen: it moves by steps only.
  button.addEventListener("click", (event) => {
    if (event.detail === 0 && event.isTrusted && !event.pointerType && byId("jog-step").value !== "on") press(button, axis, sign);
  });
  return button;
}

function buildPad() {
  const pad = byId("jog-pad");
  const names = Object.keys(axes);
  const key = names.map((name) => name + axes[name].unit).join();
  if (pad.dataset.axes === key) return;
  pad.dataset.axes = key;
  release();
  const rest = new Set(names);
  const parts = [];
  if (rest.has("x") && rest.has("y")) {
    rest.delete("x");
    rest.delete("y");
    parts.push(make("div", { class: "jog-cross" },
      jogButton("y", 1, "up", "y+"), jogButton("x", -1, "left", "x\u2212"), make("span", { class: "middle", "aria-hidden": "true" }, "xy"),
      jogButton("x", 1, "right-side", "x+"), jogButton("y", -1, "down", "y\u2212")));
  }
  // The height comes first, and then axes that are no direction of the tool.
  for (const axis of [...rest].sort((a, b) => Number(b === "z") - Number(a === "z"))) {
    parts.push(make("div", { class: "jog-column" },
      jogButton(axis, 1, "", `${axis}+`), make("span", { "aria-hidden": "true" }, axis), jogButton(axis, -1, "", `${axis}\u2212`)));
  }
  pad.replaceChildren(...parts);
}

/** Keys on the pad, whichever of its buttons has the focus. */
const KEYS = {
  ArrowUp: ["y", 1], ArrowDown: ["y", -1], ArrowLeft: ["x", -1], ArrowRight: ["x", 1], PageUp: ["z", 1], PageDown: ["z", -1],
};

/** Builds the pad from the axes that the status names. */
export function startJog() {
  const step = byId("jog-step");
  setOptions(step, STEPS.map(([value, text]) => [value, value === "on" ? text : `${text} mm or °`]), "1");
  setOptions(byId("jog-speed"), SPEEDS.map((value) => [value, `${value} mm/s or °/s`]), "20");
  const pad = byId("jog-pad");
  pad.addEventListener("keydown", (event) => {
    const way = KEYS[event.key];
    if (!way || !axes[way[0]]) return;
    event.preventDefault();
    if (event.repeat) return;
    const name = `Jog ${way[0]} ${way[1] > 0 ? "plus" : "minus"}`;
    const button = [...pad.querySelectorAll("button")].find((it) => it.getAttribute("aria-label") === name);
    if (button) press(button, ...way);
  });
  pad.addEventListener("keyup", release);
  pad.addEventListener("focusout", ({ relatedTarget }) => {
    if (!pad.contains(relatedTarget)) release();
  });
  window.addEventListener("blur", release);
  window.addEventListener("pagehide", release);
  document.addEventListener("visibilitychange", release);
  step.addEventListener("change", release);
  on("link", ({ open }) => {
    if (!open) release();
  });
  on("status", ({ status: now }) => {
    axes = now.axes;
    buildPad();
  });
  on("refusal", ({ of, text }) => {
    if (of !== "jog") return;
    release();
    refuse(byId("jog-note"), text);
  });
}
