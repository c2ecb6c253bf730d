// Where to look: the extremes of all curves, and what happened, each with a way there.

/** A table of the largest value of each curve and when it was. */
function extremesTable(run, clock) {
  const rows = [];
  for (const [id, curves] of run.charts) {
    const { title, unit } = CHARTS[id];
    for (const curve of curves) {
      const extreme = curve.extreme();
      if (!extreme) continue;
      const name = curves.length > 1 ? `${title}, ${curve.name}` : title;
      const label = `Go to the largest ${name} at ${clockText(extreme.time)}`;
      rows.push(element("tr", {}, element("th", { scope: "row" }, name),
        element("td", {}, `${short(extreme.value)} ${unit}`),
        element("td", {}, button(clockText(extreme.time, run.period), label, () => clock.visit(extreme.time)))));
    }
  }
  const head = element("tr", {}, ...["curve", "largest", "at"].map((text) => element("th", { scope: "col" }, text)));
  return element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows));
}

/** A list of what happened. */
function eventsList(run, clock) {
  const entries = run.events.map(({ time, text }) =>
    element("li", {}, button(clockText(time, run.period), `Go to ${text} at ${clockText(time)}`, () => clock.visit(time)), ` ${text}`));
  return element("ol", { class: "events" }, ...entries);
}

/** Goes to where a stroke begins. */
function strokeFinder(run, clock) {
  const { track } = run;
  const said = element("output", {});
  const input = element("input", { type: "number", min: "1", max: String(run.strokes), value: "1", inputmode: "numeric" });
  const go = (event) => {
    event.preventDefault();
    const stroke = Number(input.value);
    let index = 0;
    while (index < track.count && !(track.isLit(index) && track.stroke[index] === stroke)) index += 1;
    said.textContent = index < track.count ? "" : `stroke ${stroke} was not marked`;
    if (index < track.count) clock.visit(track.time[index]);
  };
  return element("form", { class: "finder", onsubmit: go },
    element("label", {}, "Stroke ", input), ` of ${run.strokes} `, element("button", { type: "submit" }, "Go"), " ", said);
}

function keysHelp() {
  const keys = [
    ["Space", "play, pause"], ["← →", "a cycle back or on; ten with Shift"], ["[ ]", "slower, faster"],
    ["Home End", "start, end"], ["+ −", "less, more time"], ["0", "all of the time"],
    ["M", "marker: values are told against it"], ["F", "all of the path"],
  ];
  const uses = [
    ["Path", "drag moves it (turns it in space, with Shift moves it), the wheel zooms, a click goes to the time the tool was there, a double click fits"],
    ["Charts", "a drag chooses the time to show, with Shift moves it, Ctrl and the wheel zoom, a click sets the cursor, a double click shows all"],
    ["Touch", "one finger moves, two zoom"],
  ];
  const list = (rows) => element("dl", { class: "keys" }, ...rows.flatMap(([key, text]) => [element("dt", {}, key), element("dd", {}, text)]));
  return element("details", {}, element("summary", {}, "Keys and gestures"), list(keys), list(uses));
}
