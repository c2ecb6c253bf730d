// Rulers in millimetres along the upper and the left edge of a drawing seen from above, and the grid that they count.

import { color } from "./theme.js";
import { roundStep } from "./format.js";

/** How wide a ruler is [pixels]. */
export const RULER = 24;

/** Millimetres between two labels, and between two lines of the grid. */
function steps(projection) {
  const pixels = projection.scale * 1e-3;
  const label = roundStep(76 / pixels);
  const lead = label / 10 ** Math.floor(Math.log10(label) + 1e-9);
  return [label, Math.round(lead) === 2 ? label / 4 : label / 5];
}

function eachLine(from, to, step, visit) {
  const first = Math.ceil(from / step - 1e-9);
  const last = Math.floor(to / step + 1e-9);
  if (last - first > 2000) return;
  for (let index = first; index <= last; index++) visit(index * step, index);
}

/** Lines of the grid. */
export function drawGrid(context, projection) {
  const { width, height } = projection;
  const [label, minor] = steps(projection);
  const [left, top] = projection.placeAt(0, 0).map((value) => value * 1e3);
  const [right, bottom] = projection.placeAt(width, height).map((value) => value * 1e3);
  const at = [0, 0];
  const every = Math.round(label / minor);
  context.lineWidth = 1;
  for (const [name, isStrong] of [["ink-grid", false], ["ink-grid-strong", true]]) {
    context.strokeStyle = color(name);
    context.beginPath();
    const vertical = (value, index) => {
      if ((index % every === 0) !== isStrong) return;
      projection.project(value / 1e3, 0, 0, at);
      const x = Math.round(at[0]) + 0.5;
      context.moveTo(x, 0);
      context.lineTo(x, height);
    };
    const horizontal = (value, index) => {
      if ((index % every === 0) !== isStrong) return;
      projection.project(0, value / 1e3, 0, at);
      const y = Math.round(at[1]) + 0.5;
      context.moveTo(0, y);
      context.lineTo(width, y);
    };
    eachLine(left, right, minor, vertical);
    eachLine(bottom, top, minor, horizontal);
    context.stroke();
  }
}

/** The rulers, with marks where the pointer and the tool are: each [x, y] on the canvas, or null. */
export function drawRulers(context, projection, pointer, tool) {
  const { width, height } = projection;
  const [label, minor] = steps(projection);
  const [left, top] = projection.placeAt(0, 0).map((value) => value * 1e3);
  const [right, bottom] = projection.placeAt(width, height).map((value) => value * 1e3);
  const every = Math.round(label / minor);
  const places = Math.max(0, -Math.floor(Math.log10(label) + 1e-9));
  const at = [0, 0];
  const text = (value) => (Math.abs(value) < label / 1e3 ? "0" : value.toFixed(places).replace("-", "\u2212"));
  context.fillStyle = color("panel");
  context.fillRect(0, 0, width, RULER);
  context.fillRect(0, 0, RULER, height);
  context.strokeStyle = color("line");
  context.beginPath();
  context.moveTo(0, RULER + 0.5);
  context.lineTo(width, RULER + 0.5);
  context.moveTo(RULER + 0.5, 0);
  context.lineTo(RULER + 0.5, height);
  context.stroke();
  context.strokeStyle = color("ink-ruler");
  context.fillStyle = color("ink-ruler");
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "top";
  context.beginPath();
  eachLine(left, right, minor, (value, index) => {
    projection.project(value / 1e3, 0, 0, at);
    const x = Math.round(at[0]) + 0.5;
    if (x < RULER) return;
    context.moveTo(x, RULER);
    context.lineTo(x, index % every === 0 ? RULER - 9 : RULER - 4);
    if (index % every === 0) context.fillText(text(value), x + 3, 2);
  });
  eachLine(bottom, top, minor, (value, index) => {
    projection.project(0, value / 1e3, 0, at);
    const y = Math.round(at[1]) + 0.5;
    if (y < RULER) return;
    context.moveTo(RULER, y);
    context.lineTo(index % every === 0 ? RULER - 9 : RULER - 4, y);
    if (index % every === 0) {
      context.save();
      context.translate(2, y - 3);
      context.rotate(-Math.PI / 2);
      context.fillText(text(value), 0, 0);
      context.restore();
    }
  });
  context.stroke();
  for (const [place, name, size] of [[pointer, "dim", 1], [tool, "ink-tool", 2]]) {
    if (!place) continue;
    context.fillStyle = color(name);
    if (place[0] > RULER) context.fillRect(place[0] - size / 2, 0, size, RULER);
    if (place[1] > RULER) context.fillRect(0, place[1] - size / 2, RULER, size);
  }
  context.fillStyle = color("panel");
  context.fillRect(0, 0, RULER, RULER);
  context.fillStyle = color("ink-ruler");
  context.fillText("mm", 3, 6);
}
