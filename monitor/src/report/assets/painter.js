// Draws the way of the tool and what was to be marked with a camera, thinned to what the screen shows.

/** From little to much, told apart in both schemes. */
const RAMP = ["#4a6fe3", "#2f9bd8", "#22a99a", "#57ad4c", "#a8a82a", "#d9a21b", "#e67f2a", "#e0552f", "#d02f4f"];

/** Movement on the screen that is too small to draw. */
const FINE = 0.6;
/** Lines that are stroked at once. */
const BATCH = 4000;

class Painter {
  constructor(run) {
    this.run = run;
    const speed = run.charts.get("speed")?.[0];
    const { track } = run;
    this.measures = {
      deviation: { unit: "µm", of: (index) => track.distance(index) * 1e6 },
      speed: speed && { unit: "m/s", of: (index) => speed.at(track.time[index])[1] },
      power: { unit: "%", of: (index) => track.power(index) * 100 },
      time: { unit: "s", of: (index) => track.time[index] },
    };
    this.ranges = {};
  }

  /** Lowest and highest value of a measure over what was marked. */
  range(name) {
    if (this.ranges[name]) return this.ranges[name];
    const { track } = this.run;
    let [low, high] = [Infinity, -Infinity];
    for (let index = 0; index < track.count; index += 1) {
      if (!track.isLit(index)) continue;
      const value = this.measures[name].of(index);
      if (value < low) low = value;
      if (value > high) high = value;
    }
    this.ranges[name] = low < high ? [low, high] : [0, Math.max(high, 1)];
    return this.ranges[name];
  }

  /**
   * Strokes the lines between points `from` to `to` for which `kind(index)` gives a number of `styles`, later styles
   * below earlier ones; −1 is no line. `extra` moves each point by that multiple of its deviation.
   */
  lines(context, camera, { place, deviation, from, to, extra = 0, kind, styles }) {
    const [px, py, pz] = place;
    const [dx, dy, dz] = extra === 0 ? place : deviation;
    const [rx, ry, rz] = camera.right.map((part) => part * camera.scale);
    const [ux, uy, uz] = camera.up.map((part) => part * camera.scale);
    const [width, height] = [camera.width, camera.height];
    // Of the machine's origin.
    const left = 0.5 * width + camera.scale * camera.along(camera.right, [0, 0, 0]);
    const below = 0.5 * height - camera.scale * camera.along(camera.up, [0, 0, 0]);
    const paths = styles.map(() => ({ path: new Path2D(), lines: 0 }));
    const stroke = (style) => {
      const { colour, line, alpha = 1 } = styles[style];
      context.strokeStyle = colour;
      context.lineWidth = line;
      context.globalAlpha = alpha;
      context.stroke(paths[style].path);
      paths[style] = { path: new Path2D(), lines: 0 };
    };
    let [x0, y0, isDrawn] = [0, 0, false];
    let [style, next] = [-1, from < to ? kind(from) : -1];
    for (let index = from; index < to; index += 1) {
      const before = style;
      style = next;
      next = index + 1 < to ? kind(index + 1) : -1;
      if (style < 0) continue;
      if (before !== style) {
        const [x, y, z] = [px[index] + extra * dx[index], py[index] + extra * dy[index], pz[index] + extra * dz[index]];
        x0 = left + rx * x + ry * y + rz * z;
        y0 = below - ux * x - uy * y - uz * z;
        isDrawn = false;
        paths[style].path.moveTo(x0, y0);
      }
      const a = px[index + 1] + extra * dx[index + 1];
      const b = py[index + 1] + extra * dy[index + 1];
      const c = pz[index + 1] + extra * dz[index + 1];
      const x1 = left + rx * a + ry * b + rz * c;
      const y1 = below - ux * a - uy * b - uz * c;
      const isNear = Math.abs(x1 - x0) < FINE && Math.abs(y1 - y0) < FINE;
      if (isNear && next === style) continue;
      const entry = paths[style];
      if ((x1 < 0 && x0 < 0) || (y1 < 0 && y0 < 0) || (x1 > width && x0 > width) || (y1 > height && y0 > height)) {
        entry.path.moveTo(x1, y1);
      } else if (isNear && !isDrawn) {
        // A dot.
        entry.path.moveTo(x1 - 1, y1);
        entry.path.lineTo(x1 + 1, y1);
        entry.lines += 1;
      } else {
        entry.path.lineTo(x1, y1);
        entry.lines += 1;
        isDrawn = true;
      }
      x0 = x1;
      y0 = y1;
      if (entry.lines >= BATCH) {
        stroke(style);
        paths[style].path.moveTo(x0, y0);
      }
    }
    for (let last = styles.length - 1; last >= 0; last -= 1) if (paths[last].lines > 0) stroke(last);
    context.globalAlpha = 1;
  }

  /** The place of each point in the ramp. */
  shades(name) {
    if (this.shaded?.name === name) return this.shaded.list;
    const [low, high] = this.range(name);
    const { of } = this.measures[name];
    const last = RAMP.length - 1;
    const list = new Uint8Array(this.run.track.count);
    for (let index = 0; index < list.length; index += 1) {
      list[index] = Math.min(Math.max(Math.floor(((of(index) - low) / (high - low)) * RAMP.length), 0), last) || 0;
    }
    this.shaded = { name, list };
    return list;
  }

  /** Draws what was to be marked, from one of its points to another. */
  plan(context, camera, from, to, style) {
    const { place, stroke } = this.run.plan;
    const last = stroke.length - 1;
    // The last point of a line is of no stroke; that of a dot is its only one.
    const isDot = (index) => stroke[index] > 0 && (index === last || (stroke[index + 1] > 0 && stroke[index + 1] !== stroke[index]));
    const kind = (index) => (stroke[index] > 0 && !isDot(index) ? 0 : -1);
    this.lines(context, camera, { place, from, to: Math.min(to, Math.max(last, 0)), kind, styles: [style] });
    context.fillStyle = style.colour;
    context.globalAlpha = style.alpha ?? 1;
    for (let index = from; index < to; index += 1) {
      if (!isDot(index)) continue;
      const at = place.map((numbers) => numbers[index]);
      context.fillRect(camera.x(at) - 2, camera.y(at) - 2, 4, 4);
    }
    context.globalAlpha = 1;
  }

  /** Draws the way of the tool between two of its points. */
  track(context, camera, { from, to, extra, colourBy, isDarkShown, isMarkedShown, faint, colours: { marked, dark } }) {
    const { track } = this.run;
    const [first, last] = faint;
    const measure = this.measures[colourBy];
    const styles = measure
      ? RAMP.map((colour) => ({ colour, line: 1.8 }))
      : [{ colour: marked, line: 1.6 }];
    const plain = styles.length;
    styles.push({ colour: dark, line: 1, alpha: 0.75 }, { colour: marked, line: 1.2, alpha: 0.22 }, { colour: dark, line: 1, alpha: 0.2 });
    const shades = measure ? this.shades(colourBy) : null;
    const kind = (index) => {
      const light = track.light[index];
      const isInside = index >= first && index <= last;
      if (light === LIGHT.DARK) return isDarkShown ? (isInside ? plain : plain + 2) : -1;
      if (light < LIGHT.LIT || !isMarkedShown) return -1;
      return isInside ? (shades ? shades[index] : 0) : plain + 1;
    };
    this.lines(context, camera, {
      place: track.place, deviation: track.deviation, from, to: Math.min(to, track.count - 1), extra, kind, styles,
    });
  }
}
