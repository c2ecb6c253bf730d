// The drawing of the first view: what the job under way marks, the path as it is marked, and the tool.

import { byId } from "./dom.js";
import { http, on } from "./connection.js";
import { Drawing, offerOrbit } from "./drawing.js";
import { Trail } from "./trail.js";

/** How often the drawing of a job is fetched again while it is still planned [ms]. */
const AGAIN = 4000;
/** How long it waits after a failure [ms]. */
const RETRY = 1500;

/** Shows path and drawing whenever they change. */
export function startMap() {
  const trail = new Trail();
  const drawing = new Drawing(byId("drawing"), trail);
  let isSpatial = null;
  /** What was fetched: the stream and how far its plan was. */
  let fetched = "";
  let fetchedAt = 0;

  const fetchArtwork = async () => {
    fetchedAt = performance.now();
    try {
      const artwork = await http("GET", "artwork");
      if (artwork?.strokes?.length) drawing.setArtwork(artwork);
    } catch {
      // The job has ended meanwhile, or its drawing is not known yet: it is asked for again.
      fetched = "";
      fetchedAt += RETRY;
    }
  };

  on("hello", ({ machine }) => {
    drawing.setArea(machine.area, machine.home);
    if (isSpatial !== Boolean(machine.is_spatial)) offerOrbit(drawing, Boolean(machine.is_spatial));
    isSpatial = Boolean(machine.is_spatial);
    trail.clear();
    fetched = "";
    drawing.invalidate();
  });
  on("path", ({ points, reset }) => {
    if (reset) {
      trail.clear();
      drawing.setArtwork(null);
      fetched = "";
    }
    trail.add(points);
    const last = points.at(-1);
    if (last) drawing.setTool(last.slice(0, 3), last[3] > 0.02);
  });
  on("status", ({ status: now }) => {
    drawing.setTool(now.tool, Boolean(now.lit));
    if (!now.job || !now.stream) return;
    const key = `${now.stream} ${now.planner}`;
    const grows = now.planner === "planning" || now.planner === "streaming";
    const waited = performance.now() - fetchedAt;
    if (waited > 500 && (fetched !== key || (grows && waited > AGAIN))) {
      fetched = key;
      fetchArtwork();
    }
  });
  window.addEventListener("viewshown", () => drawing.request());
}
