// Mouse, touch and pen on a canvas: drags, pinches, taps and the wheel.

/** Movement that makes a drag of a press [units of the page]. */
const STILL = 4;

class Gestures {
  /**
   * `actions`: drag(dx, dy, isPan), zoom(factor, x, y), tap(x, y), hover(x, y), leave(), double(). Turns of the
   * wheel for which `isMeant` is false scroll the page.
   */
  constructor(canvas, actions, isMeant = () => true) {
    Object.assign(this, { canvas, actions });
    this.pointers = new Map();
    this.moved = 0;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event, true));
    canvas.addEventListener("pointercancel", (event) => this.up(event, false));
    canvas.addEventListener("pointerleave", () => actions.leave());
    canvas.addEventListener("dblclick", () => actions.double());
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      if (!isMeant(event)) return;
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      actions.zoom(Math.exp(-event.deltaY * lines * 0.0015), event.offsetX, event.offsetY);
    }, { passive: false });
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    this.moved = this.pointers.size > 1 ? STILL + 1 : 0;
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    const at = [event.offsetX, event.offsetY];
    if (!before) {
      this.actions.hover(...at);
      return;
    }
    const [dx, dy] = [at[0] - before[0], at[1] - before[1]];
    this.moved += Math.hypot(dx, dy);
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const span = (point) => Math.max(Math.hypot(point[0] - other[0], point[1] - other[1]), 1);
      this.actions.zoom(span(at) / span(before), 0.5 * (at[0] + other[0]), 0.5 * (at[1] + other[1]));
      this.actions.drag(0.5 * dx, 0.5 * dy, true);
    } else if (this.moved > STILL) {
      this.actions.drag(dx, dy, event.shiftKey || event.buttons > 1);
    }
    this.pointers.set(event.pointerId, at);
  }

  up(event, isTap) {
    this.pointers.delete(event.pointerId);
    if (isTap && this.moved <= STILL && event.button === 0) this.actions.tap(event.offsetX, event.offsetY);
  }
}
