// The data of the page: what column.rs and data.rs wrote, as typed arrays.

/** The numbers of a column. */
async function readColumn(index, { count, bytes }) {
  const text = document.getElementById(`column-${index}`).textContent;
  const binary = atob(text);
  const deflated = new Uint8Array(binary.length);
  for (let at = 0; at < binary.length; at += 1) deflated[at] = binary.charCodeAt(at);
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  if (planes.length !== count * bytes) throw new Error(`column ${index} is not whole`);
  const numbers = new Float64Array(count);
  let told = 0;
  for (let at = 0; at < count; at += 1) {
    let natural = 0;
    for (let plane = bytes - 1; plane >= 0; plane -= 1) natural = natural * 256 + planes[plane * count + at];
    told += natural % 2 === 1 ? -(natural + 1) / 2 : natural / 2;
    numbers[at] = told;
  }
  return numbers;
}

const readColumns = ({ columns, layouts }) =>
  Promise.all(columns.map((column, index) => readColumn(column, layouts[index])));

const scaled = (numbers, step) => Float32Array.from(numbers, (number) => number * step);

/** A curve: lowest and highest value of each bucket, NaN where there is none. */
async function readCurve(header, width) {
  const [lowest, above] = await readColumns(header);
  const value = (steps) => header.low + (steps - 1) * header.step;
  const low = Float32Array.from(lowest, (steps) => (steps === 0 ? NaN : value(steps)));
  const high = above
    ? Float32Array.from(lowest, (steps, index) => (steps === 0 ? NaN : value(steps + above[index])))
    : low;
  return new Curve(header.name, low, high, width);
}

/** The way of the tool, point by point: time [s], place and deviation [m], light, stroke. */
async function readTrack(header) {
  const [time, x, y, z, dx, dy, dz, light, stroke] = await readColumns(header);
  const { place_step: place, deviation_step: deviation } = header;
  return new Track({
    time: Float64Array.from(time, (steps) => steps * header.time_step),
    place: [x, y, z].map((numbers) => scaled(numbers, place)),
    deviation: [dx, dy, dz].map((numbers) => scaled(numbers, deviation)),
    light: Uint16Array.from(light),
    powerStep: header.power_step,
    stroke: Uint32Array.from(stroke),
    tolerance: header.tolerance,
  });
}

/** What was to be marked: points in the order of marking, and the line of each stroke in the job file. */
async function readPlan(header) {
  const [x, y, z, stroke, lines] = await readColumns(header);
  return {
    place: [x, y, z].map((numbers) => scaled(numbers, header.place_step)),
    stroke: Uint32Array.from(stroke),
    lines: Uint32Array.from(lines),
  };
}

/** Everything that the page tells of the run. */
async function readRun() {
  const header = JSON.parse(document.getElementById("run").textContent);
  const width = header.period * header.stride;
  const [curves, track, plan] = await Promise.all([
    Promise.all(header.curves.map((curve) => readCurve(curve, width))),
    readTrack(header.track),
    readPlan(header.plan),
  ]);
  const charts = new Map();
  header.curves.forEach(({ chart }, index) => {
    if (!charts.has(chart)) charts.set(chart, []);
    charts.get(chart).push(curves[index]);
  });
  const { period, stride, time, job, strokes, events } = header;
  return { period, width, stride, time: Math.max(time, width), job, strokes, events, charts, track, plan };
}
