// Numbers as people read them, ticks of axes, and elements of the page.

/** A number with as many digits as matter beside `step`. */
function short(value, step = Math.abs(value) / 999) {
  if (!Number.isFinite(value)) return "–";
  const digits = Math.min(Math.max(-Math.floor(Math.log10(step || 1) + 1e-9), 0), 6);
  return value.toFixed(digits).replace(/^-(?=0(\.0*)?$)/, "").replace("-", "−");
}

/** A time as minutes and seconds, or as milliseconds beside a small step [s]. */
function clockText(time, step = 0.001) {
  const digits = Math.min(Math.max(-Math.floor(Math.log10(step) + 1e-9), 0), 6);
  const sign = time < 0 ? "−" : "";
  const seconds = Number(Math.abs(time).toFixed(digits));
  if (seconds < 60) return `${sign}${seconds.toFixed(digits)} s`;
  const minutes = Math.floor(seconds / 60);
  const rest = (seconds - 60 * minutes).toFixed(digits).padStart(digits ? digits + 3 : 2, "0");
  return minutes < 60
    ? `${sign}${minutes}:${rest}`
    : `${sign}${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")}:${rest}`;
}

/** A round step for about `count` ticks over a range. */
function tickStep(range, count) {
  const rough = range / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999) * power;
}

/** A step for about `count` ticks over a time [s]: from ten seconds on in parts of a minute or of an hour. */
function timeStep(range, count) {
  const rough = range / Math.max(count, 1);
  return [10, 20, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200].find((step) => rough > 5 && step >= rough) ?? tickStep(range, count);
}

/** The ticks of an axis. */
function* ticks(from, to, step) {
  for (let index = Math.ceil(from / step - 1e-6); index * step <= to + 1e-6 * step; index += 1) yield index * step;
}

/** An element with attributes (`on…` are listeners) and children. */
function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== null) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

const button = (text, label, action, attributes = {}) =>
  element("button", { type: "button", title: label, "aria-label": label, onclick: action, ...attributes }, text);

/** A labelled choice; `choices` are pairs of value and text. */
function choice(label, choices, chosen, action) {
  const options = choices.map(([value, text]) => element("option", { value, selected: value === chosen }, text));
  const select = element("select", { onchange: () => action(select.value) }, ...options);
  return element("label", {}, `${label} `, select);
}

/** A labelled switch. */
function toggle(label, isOn, action) {
  const box = element("input", { type: "checkbox", checked: isOn, onchange: () => action(box.checked) });
  return element("label", { class: "switch" }, box, ` ${label}`);
}

/** The colours of the page's scheme; read once, until forgetColours is called. */
let scheme = null;

function forgetColours() {
  scheme = null;
}

function colours() {
  if (scheme) return scheme;
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  const names = ["ink", "grid", "paper", "back", "plan", "marked", "dark", "cursor"];
  scheme = Object.fromEntries(names.map((name) => [name, colour(name)]));
  scheme.curves = [0, 1, 2, 3, 4, 5, 6, 7].map((index) => colour(`curve-${index}`));
  return scheme;
}

/** Keeps a canvas as fine as the screen; calls `drawn` after a change of size. */
function fitCanvas(canvas, drawn) {
  new ResizeObserver(() => {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    canvas.width = Math.max(Math.round(width * ratio), 1);
    canvas.height = Math.max(Math.round(height * ratio), 1);
    drawn();
  }).observe(canvas);
}

/** The context of a canvas in units of the page, cleared; `seen` is the canvas in the page that it is meant for. */
function begin(canvas, seen = canvas) {
  if (seen !== canvas) [canvas.width, canvas.height] = [seen.width, seen.height];
  const context = canvas.getContext("2d");
  const ratio = seen.width / Math.max(seen.clientWidth, 1);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, seen.clientWidth, seen.clientHeight);
  return context;
}
