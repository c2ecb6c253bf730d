// Builds the interactive part of the report. Where that fails, the still pictures of the page stay.

/** A button that goes through the schemes of colour: as the system has it, light, dark. */
function schemeButton(changed) {
  const schemes = ["auto", "light", "dark"];
  let chosen = 0;
  const made = button("Colours: auto", "Change between light and dark colours", () => {
    chosen = (chosen + 1) % schemes.length;
    if (chosen === 0) delete document.documentElement.dataset.scheme;
    else document.documentElement.dataset.scheme = schemes[chosen];
    made.textContent = `Colours: ${schemes[chosen]}`;
    changed();
  }, { "aria-label": null });
  return made;
}

async function main() {
  const place = document.getElementById("explorer");
  place.textContent = "Reading the run …";
  try {
    const run = await readRun();
    const clock = new Clock(run);
    const path = new PathView(run, clock);
    const charts = [...run.charts].map(([id, curves]) => new Chart(id, curves, run, clock));
    const transport = new Transport(run, clock, { fit: () => path.fit() });
    const precision = run.stride > 1
      ? `The curves show lowest and highest values of ${run.stride} cycles each. `
      : "The curves show every cycle. ";
    const tolerance = run.track.tolerance > 0
      ? `The path is within ${short(run.track.tolerance * 1e6, 0.1)} µm of the tool's.`
      : "The path has every cycle.";
    const extremes = element("details", { open: true }, element("summary", {}, "Extremes"), extremesTable(run, clock));
    const events = run.events.length > 0
      ? [element("details", { open: true }, element("summary", {}, "What happened"), eventsList(run, clock))]
      : [];
    place.replaceChildren(
      element("div", { class: "views" }, path.root,
        element("section", { class: "charts", "aria-label": "Curves over time" },
          element("h2", {}, "Over time"), ...charts.map((chart) => chart.root))),
      element("section", { class: "places", "aria-label": "Places to look at" },
        element("div", {}, extremes), element("div", {}, strokeFinder(run, clock), ...events, keysHelp(),
          element("p", { class: "note" }, precision, tolerance))),
      transport.root);
    for (const chart of charts) chart.root.addEventListener("toggle", () => clock.changed());
    const redraw = () => {
      forgetColours();
      path.refresh();
    };
    document.querySelector("header").append(schemeButton(redraw));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    document.documentElement.classList.add("live");
    clock.changed();
    window.graverReport = { run, clock, path };
  } catch (error) {
    place.textContent = `The interactive part does not work in this browser (${error.message}); the pictures below show the run.`;
  }
}

main();
