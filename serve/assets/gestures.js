// Pointer, wheel and keys on a canvas, as moves of a projection.

/**
 * Listens on `canvas`; `view` has projection(), changed(), fit(), hover(x, y or null), and grab(x, y), which gives
 * {move(x, y), end()} where there is something to be dragged by itself.
 */
export function listen(canvas, view) {
  const pointers = new Map();
  let grip = null;

  const local = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  /** The middle of the pointers, and how far apart they are. */
  const spread = () => {
    const all = [...pointers.values()];
    const x = all.reduce((sum, [left]) => sum + left, 0) / all.length;
    const y = all.reduce((sum, [, top]) => sum + top, 0) / all.length;
    return [x, y, all.length > 1 ? Math.hypot(all[0][0] - all[1][0], all[0][1] - all[1][1]) : 0];
  };

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button > 1) return;
    const at = local(event);
    canvas.setPointerCapture(event.pointerId);
    // A finger moves the view only: what it lies on is too easily taken along.
    grip = pointers.size === 0 && event.pointerType !== "touch" && event.button === 0 ? view.grab?.(...at) : null;
    pointers.set(event.pointerId, at);
  });
  canvas.addEventListener("pointermove", (event) => {
    const at = local(event);
    view.hover?.(at[0], at[1]);
    if (!pointers.has(event.pointerId)) return;
    if (grip) {
      grip.move(...at);
      return;
    }
    const [x, y, apart] = spread();
    pointers.set(event.pointerId, at);
    const [newX, newY, newApart] = spread();
    const projection = view.projection();
    if (projection.turnBy && pointers.size === 1 && !event.shiftKey && event.buttons !== 4) {
      projection.turnBy(newX - x, newY - y);
    } else {
      projection.panBy(newX - x, newY - y);
      if (apart > 0 && newApart > 0) projection.zoomAt(newX, newY, newApart / apart);
    }
    view.changed();
  });
  const end = (event) => {
    pointers.delete(event.pointerId);
    grip?.end();
    grip = null;
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", () => view.hover?.(null, null));
  canvas.addEventListener("dblclick", () => view.fit());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 33 : 1;
    view.projection().zoomAt(...local(event), Math.exp(-event.deltaY * lines * 0.0016));
    view.changed();
  }, { passive: false });

  const step = 48;
  const keys = {
    ArrowLeft: (it) => it.panBy(step, 0),
    ArrowRight: (it) => it.panBy(-step, 0),
    ArrowUp: (it) => it.panBy(0, step),
    ArrowDown: (it) => it.panBy(0, -step),
    "+": (it) => it.zoomAt(it.width / 2, it.height / 2, 1.4),
    "=": (it) => it.zoomAt(it.width / 2, it.height / 2, 1.4),
    "-": (it) => it.zoomAt(it.width / 2, it.height / 2, 1 / 1.4),
    f: () => view.fit(),
    F: () => view.fit(),
  };
  canvas.addEventListener("keydown", (event) => {
    const act = event.ctrlKey || event.altKey || event.metaKey ? null : keys[event.key];
    if (!act) return;
    event.preventDefault();
    event.stopPropagation();
    const projection = view.projection();
    if (projection.turnBy && event.shiftKey && event.key.startsWith("Arrow")) {
      const turn = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] }[event.key];
      projection.turnBy(...turn);
    } else {
      act(projection);
    }
    view.changed();
  });
}
