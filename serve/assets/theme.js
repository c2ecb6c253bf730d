// Light and dark, and the colours for what is drawn on a canvas.

import { byId, make, setText } from "./dom.js";

const NAMES = { auto: "Auto", light: "Light", dark: "Dark" };
const colors = new Map();
const listeners = [];
let probe = null;

/** The colour that the style sheet calls `--NAME`, as a canvas takes it. */
export function color(name) {
  let value = colors.get(name);
  if (!value) {
    probe.style.color = `var(--${name})`;
    value = getComputedStyle(probe).color;
    colors.set(name, value);
  }
  return value;
}

/** Calls `redraw` when the colours have changed. */
export function onTheme(redraw) {
  listeners.push(redraw);
}

function changed() {
  colors.clear();
  for (const redraw of listeners) redraw();
}

function apply(choice) {
  if (choice === "auto") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = choice;
  setText(byId("theme-word"), NAMES[choice]);
  changed();
}

/** Reads the choice of this browser, and follows the button and the system. */
export function startTheme() {
  probe = make("i", { hidden: true });
  document.body.append(probe);
  let choice = localStorage.getItem("graver.theme");
  if (!(choice in NAMES)) choice = "auto";
  byId("theme").addEventListener("click", () => {
    const all = Object.keys(NAMES);
    choice = all[(all.indexOf(choice) + 1) % all.length];
    localStorage.setItem("graver.theme", choice);
    apply(choice);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
  apply(choice);
}
