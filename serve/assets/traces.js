// The signals of the scope: found by search, up to eight, each with a scale and an offset of its own.

import { byId, make, setAttribute, setText, show } from "./dom.js";
import { engineering, roundStep } from "./format.js";
import { DOWN } from "./scope_plot.js";

const MOST = 8;
/** Divisions that an automatic scale fills at most. */
const FILLED = 6;

export class Traces {
  /** `changed()` is called when signals were added or removed, `redraw()` when only their looks changed. */
  constructor(changed, redraw) {
    this.changed = changed;
    this.redraw = redraw;
    this.known = [];
    this.shown = new Map();
    this.search = byId("signal-search");
    this.list = byId("signal-list");
    this.active = -1;
    this.listen();
  }

  names() {
    return [...this.shown.keys()];
  }

  unitOf(name) {
    return this.known.find((signal) => signal.name === name)?.unit ?? "";
  }

  setKnown(signals) {
    this.known = signals ?? [];
    const names = new Set(this.known.map((signal) => signal.name));
    for (const name of this.names()) if (!names.has(name)) this.remove(name);
  }

  add(name) {
    if (this.shown.has(name) || this.shown.size >= MOST) return;
    const used = new Set([...this.shown.values()].map((trace) => trace.index));
    const index = [...Array(MOST).keys()].find((it) => !used.has(it));
    const trace = { name, index, scale: 1, offset: 0, isAuto: true, isHidden: false };
    trace.card = this.card(trace);
    this.shown.set(name, trace);
    byId("traces").append(trace.card);
    this.count();
    this.changed();
  }

  remove(name) {
    this.shown.get(name)?.card.remove();
    this.shown.delete(name);
    this.count();
    this.changed();
  }

  count() {
    setText(byId("signal-count"), `${this.shown.size} of ${MOST}`);
    this.search.disabled = this.shown.size >= MOST;
    this.search.placeholder = this.search.disabled ? "eight signals at most" : "Search: position, current, lit…";
  }

  card(trace) {
    const unit = this.unitOf(trace.name);
    const button = (text, name, act) => make("button", { type: "button", "aria-label": `${trace.name}: ${name}`, title: name, onclick: () => {
      act();
      this.label(trace);
      this.redraw();
    } }, text);
    const rescale = (factor) => {
      trace.isAuto = false;
      trace.scale = factor > 1 ? roundStep(trace.scale * 1.01) : roundStep(trace.scale / 2.51);
    };
    const shift = (divisions) => {
      trace.isAuto = false;
      trace.offset -= divisions * trace.scale * 0.5;
    };
    trace.scaleText = make("span", {});
    trace.values = ["A", "B", "Δ"].map((name) => make("div", {}, name, make("b", {}, "–")));
    const eye = make("button", { class: "small quiet", type: "button", "aria-pressed": "false", "aria-label": `Hide ${trace.name}`, onclick: () => {
      trace.isHidden = !trace.isHidden;
      setAttribute(trace.card, "data-hidden", trace.isHidden);
      setAttribute(eye, "aria-pressed", trace.isHidden);
      setText(eye, trace.isHidden ? "show" : "hide");
      this.redraw();
    } }, "hide");
    return make("div", { class: `trace trace-${trace.index + 1}`, role: "group", "aria-label": trace.name },
      make("div", { class: "row" }, make("span", { class: "name" }, trace.name, unit ? ` [${unit}]` : ""), eye,
        make("button", { class: "small quiet", type: "button", "aria-label": `Remove ${trace.name}`, onclick: () => this.remove(trace.name) }, "✕")),
      make("div", { class: "scale" },
        button("−", "finer scale", () => rescale(0.5)), trace.scaleText, button("+", "coarser scale", () => rescale(2)),
        button("↓", "move down", () => shift(-1)), button("↑", "move up", () => shift(1)),
        button("Auto", "Auto scale", () => (trace.isAuto = true))),
      make("div", { class: "values" }, ...trace.values));
  }

  label(trace) {
    setText(trace.scaleText, `${engineering(trace.scale, this.unitOf(trace.name), 2)}/div`);
  }

  /** Scales by the numbers that came; one that fits well enough stays, so that the picture does not jump. */
  autoScale(names, values) {
    names.forEach((name, index) => {
      const trace = this.shown.get(name);
      if (!trace) return;
      if (trace.isAuto) fit(trace, values[index]);
      this.label(trace);
    });
  }

  allAuto() {
    for (const trace of this.shown.values()) trace.isAuto = true;
  }

  /** Values under the cursors, or none. */
  showValues(name, a, b) {
    const trace = this.shown.get(name);
    const unit = this.unitOf(name);
    [a, b, b - a].forEach((value, index) => setText(trace.values[index].lastChild, engineering(value, unit, 4)));
  }

  matches() {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    return this.known.filter(({ name }) => !this.shown.has(name) && words.every((word) => name.toLowerCase().includes(word))).slice(0, 60);
  }

  showMatches() {
    const found = this.matches();
    this.active = Math.min(this.active, found.length - 1);
    this.list.replaceChildren(...found.map(({ name, unit }, index) => {
      const option = make("li", { role: "option", id: `signal-${index}`, "aria-selected": String(index === this.active) }, make("span", {}, name), make("span", { class: "dim" }, unit ?? ""));
      option.addEventListener("pointerdown", (event) => {
        event.preventDefault();
        this.pick(name);
      });
      return option;
    }));
    const isOpen = found.length > 0 && document.activeElement === this.search;
    show(this.list, isOpen);
    setAttribute(this.search, "aria-expanded", isOpen);
    setAttribute(this.search, "aria-activedescendant", this.active >= 0 ? `signal-${this.active}` : null);
    this.list.children[this.active]?.scrollIntoView({ block: "nearest" });
  }

  pick(name) {
    this.search.value = "";
    this.active = -1;
    this.add(name);
    this.showMatches();
  }

  listen() {
    const { search } = this;
    for (const type of ["input", "focus", "blur"]) search.addEventListener(type, () => this.showMatches());
    search.addEventListener("keydown", (event) => {
      const found = this.matches();
      if (event.key === "ArrowDown") this.active = Math.min(found.length - 1, this.active + 1);
      else if (event.key === "ArrowUp") this.active = Math.max(0, this.active - 1);
      else if (event.key === "Enter" && found.length) return this.pick(found[Math.max(0, this.active)].name);
      else if (event.key === "Escape" && !this.list.hidden) {
        this.active = -1;
        show(this.list, false);
        setAttribute(search, "aria-expanded", false);
        event.stopPropagation();
        event.preventDefault();
        return undefined;
      } else return undefined;
      event.preventDefault();
      this.showMatches();
      return undefined;
    });
    this.count();
  }
}

function fit(trace, values) {
  let [least, most] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < least) least = value;
    if (value > most) most = value;
  }
  if (least > most) return;
  const middle = (least + most) / 2;
  const range = Math.max(most - least, Math.abs(middle) * 1e-3, 1e-9);
  const scale = roundStep(range / FILLED);
  const fits = least >= trace.offset - (DOWN / 2) * trace.scale && most <= trace.offset + (DOWN / 2) * trace.scale;
  if (trace.isFitted && fits && trace.scale <= scale * 2.6) return;
  trace.isFitted = true;
  trace.scale = scale;
  trace.offset = Math.round(middle / scale) * scale;
}
