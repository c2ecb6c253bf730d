// The time that all views share: the cursor, the marker, the window that charts show, and playback.

class Clock {
  constructor(run) {
    this.end = run.time;
    this.step = run.width;
    this.cursor = 0;
    this.marker = null;
    this.from = 0;
    this.to = run.time;
    this.rate = 1;
    this.isPlaying = false;
    this.listeners = [];
    this.isDue = false;
  }

  /** Calls `listener` once per picture after any change. */
  listen(listener) {
    this.listeners.push(listener);
  }

  changed() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame((now) => {
      this.isDue = false;
      if (this.isPlaying) this.advance(now);
      for (const listener of this.listeners) listener();
      if (this.isPlaying) this.changed();
    });
  }

  advance(now) {
    const passed = this.before === null ? 0 : Math.min((now - this.before) / 1000, 0.25);
    this.before = now;
    const cursor = this.cursor + passed * this.rate;
    if (cursor >= this.end) this.isPlaying = false;
    this.place(cursor);
  }

  place(time) {
    this.cursor = Math.min(Math.max(time, 0), this.end);
    // The window goes along, a page at a time.
    const width = this.to - this.from;
    if (this.cursor > this.to || this.cursor < this.from) {
      this.from = Math.min(Math.max(this.cursor - 0.05 * width, 0), this.end - width);
      this.to = this.from + width;
    }
  }

  seek(time) {
    this.place(time);
    this.changed();
  }

  show(from, to) {
    const width = Math.min(Math.max(to - from, 8 * this.step), this.end);
    const middle = 0.5 * (from + to);
    this.from = Math.min(Math.max(middle - 0.5 * width, 0), this.end - width);
    this.to = this.from + width;
    this.changed();
  }

  /** Makes the window `factor` times as wide about a time. */
  zoom(factor, about = this.cursor) {
    const around = Math.min(Math.max(about, this.from), this.to);
    this.show(around - (around - this.from) * factor, around + (this.to - around) * factor);
  }

  isWhole() {
    return this.to - this.from > 0.999 * this.end;
  }

  /** Goes to a time and shows what was around it. */
  visit(time) {
    const width = Math.min(Math.max(400 * this.step, 0.02 * this.end), this.end);
    this.isPlaying = false;
    this.show(time - 0.5 * width, time + 0.5 * width);
    this.seek(time);
  }

  play(on = !this.isPlaying) {
    if (on && this.cursor >= this.end) this.place(0);
    this.isPlaying = on;
    this.before = null;
    this.changed();
  }

  mark() {
    this.marker = this.marker === null ? this.cursor : null;
    this.changed();
  }
}
