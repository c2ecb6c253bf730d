// What is drawn into a drawing: the working area, strokes and dots, the tool, and the axes of the view in space.

import { fixed } from "./format.js";
import { color } from "./theme.js";

/** The working area, its home, and the grid upon it. */
export function drawArea(context, projection, area, home, grid) {
  if (area) {
    const isFlat = grid !== null;
    const edges = boxEdges(area, isFlat);
    if (isFlat) {
      context.fillStyle = color("ink-area");
      outline(context, projection, edges[0]);
      context.fill();
      grid();
    }
    context.strokeStyle = color("line-strong");
    context.lineWidth = isFlat ? 1.5 : 1;
    context.globalAlpha = isFlat ? 1 : 0.6;
    for (const edge of edges) {
      outline(context, projection, edge);
      context.stroke();
    }
    context.globalAlpha = 1;
  } else {
    grid?.();
  }
  if (!home) return;
  const at = [0, 0];
  projection.project(home[0], home[1], home[2] ?? 0, at);
  context.strokeStyle = color("line-strong");
  context.lineWidth = 1;
  context.beginPath();
  context.arc(at[0], at[1], 5, 0, 2 * Math.PI);
  for (const [dx, dy] of [[1, 0], [0, 1]]) {
    context.moveTo(at[0] - 9 * dx, at[1] - 9 * dy);
    context.lineTo(at[0] + 9 * dx, at[1] + 9 * dy);
  }
  context.stroke();
}

/** The area from above as one loop; in space the loops below and above, and the uprights between them. */
function boxEdges({ lower: a, upper: b }, isFlat) {
  const loop = (z) => [[a[0], a[1], z], [b[0], a[1], z], [b[0], b[1], z], [a[0], b[1], z], [a[0], a[1], z]];
  const [low, high] = [a[2] ?? 0, b[2] ?? 0];
  if (isFlat || low === high) return [loop(low)];
  return [loop(low), loop(high), ...loop(low).slice(0, 4).map(([x, y]) => [[x, y, low], [x, y, high]])];
}

function outline(context, projection, points) {
  const at = [0, 0];
  context.beginPath();
  points.forEach(([x, y, z], index) => {
    projection.project(x, y, z, at);
    if (index === 0) context.moveTo(at[0], at[1]);
    else context.lineTo(at[0], at[1]);
  });
}

/** What is to be marked; strong where it is all that is shown. */
export function drawArtwork(context, projection, strokes, isStrong) {
  const at = [0, 0];
  const dots = [];
  context.strokeStyle = color(isStrong ? "ink-mark" : "ink-artwork");
  context.lineWidth = isStrong ? 1.5 : 1.25;
  context.lineJoin = "round";
  context.beginPath();
  for (const stroke of strokes) {
    if (stroke.length === 1) {
      projection.project(stroke[0][0], stroke[0][1], stroke[0][2] ?? 0, at);
      dots.push(at[0], at[1]);
      continue;
    }
    for (let index = 0; index < stroke.length; index++) {
      const point = stroke[index];
      projection.project(point[0], point[1], point[2] ?? 0, at);
      if (index === 0) context.moveTo(at[0], at[1]);
      else context.lineTo(at[0], at[1]);
    }
  }
  context.stroke();
  context.fillStyle = context.strokeStyle;
  const size = dots.length > 4000 ? 1.2 : 2.2;
  for (let index = 0; index < dots.length; index += 2) {
    context.fillRect(dots[index] - size / 2, dots[index + 1] - size / 2, size, size);
  }
}

/** The box around a drawing, with its size. */
export function drawBounds(context, projection, bounds) {
  if (!bounds) return;
  const [from, to] = [[0, 0], [0, 0]];
  projection.project(bounds.lower[0], bounds.upper[1], 0, from);
  projection.project(bounds.upper[0], bounds.lower[1], 0, to);
  context.strokeStyle = context.fillStyle = color("dim");
  context.lineWidth = 1;
  context.setLineDash([4, 4]);
  context.strokeRect(from[0] - 5, from[1] - 5, to[0] - from[0] + 10, to[1] - from[1] + 10);
  context.setLineDash([]);
  const size = [0, 1].map((axis) => fixed((bounds.upper[axis] - bounds.lower[axis]) * 1e3, 1));
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "right";
  context.fillText(`${size[0]} × ${size[1]} mm`, to[0] + 5, to[1] + 20);
  context.textAlign = "start";
}

/** The tool: a cross with a ring, and a bright middle while the laser is lit. */
export function drawTool(context, [x, y], isLit) {
  context.lineWidth = 1.5;
  context.strokeStyle = color("ink-tool");
  if (isLit) {
    context.fillStyle = color("ink-lit");
    context.globalAlpha = 0.35;
    disc(context, x, y, 11);
    context.globalAlpha = 1;
    disc(context, x, y, 4.5);
  }
  context.beginPath();
  context.arc(x, y, 8, 0, 2 * Math.PI);
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    context.moveTo(x + 8 * dx, y + 8 * dy);
    context.lineTo(x + 15 * dx, y + 15 * dy);
  }
  context.stroke();
}

function disc(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
}

/** The directions of the machine, at the lower left of a view in space. */
export function drawAxes(context, projection) {
  const [x, y] = [46, projection.height - 46];
  const { rightAxis: right, upAxis: up } = projection;
  context.font = "600 12px system-ui, sans-serif";
  context.textBaseline = "middle";
  context.textAlign = "center";
  context.lineWidth = 2;
  ["x", "y", "z"].forEach((name, axis) => {
    const [dx, dy] = [right[axis] * 30, -up[axis] * 30];
    context.strokeStyle = context.fillStyle = color(["trace-7", "trace-3", "trace-1"][axis]);
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + dx, y + dy);
    context.stroke();
    context.fillText(name, x + dx * 1.3, y + dy * 1.3);
  });
  context.textAlign = "start";
}
