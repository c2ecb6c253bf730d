// What helps to read a picture of the path: millimetres along its edges, or the box around it in space.

const MILLIMETRES = 1000;

/** Draws millimetres for a view from above. */
function drawRuler(context, camera, { ink, grid }) {
  const step = tickStep(90 / camera.scale, 1);
  const [low, high] = [camera.place(0, camera.height), camera.place(camera.width, 0)];
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 1;
  context.strokeStyle = grid;
  context.fillStyle = ink;
  context.beginPath();
  for (const x of ticks(low[0], high[0], step)) {
    const at = Math.round(camera.x([x, 0, 0])) + 0.5;
    context.moveTo(at, 0);
    context.lineTo(at, camera.height);
  }
  for (const y of ticks(low[1], high[1], step)) {
    const at = Math.round(camera.y([0, y, 0])) + 0.5;
    context.moveTo(0, at);
    context.lineTo(camera.width, at);
  }
  context.stroke();
}

/** Writes the numbers of the ruler over everything else. */
function drawRulerText(context, camera, { ink, paper }) {
  const step = tickStep(90 / camera.scale, 1);
  const [low, high] = [camera.place(0, camera.height), camera.place(camera.width, 0)];
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 3;
  context.strokeStyle = paper;
  context.fillStyle = ink;
  const write = (text, x, y) => {
    context.strokeText(text, x, y);
    context.fillText(text, x, y);
  };
  const name = (value) => short(value * MILLIMETRES, step * MILLIMETRES);
  context.textAlign = "center";
  context.textBaseline = "bottom";
  for (const x of ticks(low[0], high[0], step)) {
    const at = camera.x([x, 0, 0]);
    if (at > 60 && at < camera.width - 55) write(name(x), at, camera.height - 4);
  }
  write("x [mm]", camera.width - 26, camera.height - 4);
  context.textAlign = "left";
  context.textBaseline = "middle";
  for (const y of ticks(low[1], high[1], step)) {
    const at = camera.y([0, y, 0]);
    if (at > 30 && at < camera.height - 30) write(name(y), 5, at);
  }
  write("y [mm]", 5, 12);
}

/** Draws the box around everything, with its edges in millimetres, and the directions of the axes. */
function drawBox(context, camera, { ink, grid, curves }) {
  const corner = (bits) => camera.bounds.map((range, axis) => range[(bits >> axis) & 1]);
  context.lineWidth = 1;
  context.strokeStyle = grid;
  context.beginPath();
  for (let bits = 0; bits < 8; bits += 1) {
    for (let axis = 0; axis < 3; axis += 1) {
      if ((bits >> axis) & 1) continue;
      const [from, to] = [corner(bits), corner(bits | (1 << axis))];
      context.moveTo(camera.x(from), camera.y(from));
      context.lineTo(camera.x(to), camera.y(to));
    }
  }
  context.stroke();
  context.font = "12px system-ui, sans-serif";
  context.fillStyle = ink;
  context.textAlign = "center";
  context.textBaseline = "middle";
  const middle = camera.bounds.map(([low, high]) => 0.5 * (low + high));
  ["x", "y", "z"].forEach((name, axis) => {
    const [from, to] = [corner(0), corner(1 << axis)];
    if (Math.hypot(camera.x(to) - camera.x(from), camera.y(to) - camera.y(from)) < 60) return;
    const [x, y] = [0.5 * (camera.x(from) + camera.x(to)), 0.5 * (camera.y(from) + camera.y(to))];
    // Away from the middle of the box.
    const [away, down] = [x - camera.x(middle), y - camera.y(middle)];
    const far = Math.max(Math.hypot(away, down), 1);
    const [low, high] = camera.bounds[axis].map((value) => short(value * MILLIMETRES, 0.1));
    const text = `${name} ${low} to ${high} mm`;
    const { width } = context.measureText(text);
    const aside = x + ((10 + 0.5 * width) * away) / far;
    const within = Math.min(Math.max(aside, 0.5 * width + 4), camera.width - 0.5 * width - 4);
    context.fillText(text, within, y + (14 * down) / far);
  });
  // The axes, in a corner of the picture.
  const [x0, y0, size] = [46, camera.height - 46, 30];
  ["x", "y", "z"].forEach((name, axis) => {
    const [x, y] = [x0 + size * camera.right[axis], y0 - size * camera.up[axis]];
    context.strokeStyle = context.fillStyle = curves[[4, 2, 0][axis]];
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x, y);
    context.stroke();
    context.fillText(name, x0 + (size + 10) * camera.right[axis], y0 - (size + 10) * camera.up[axis]);
  });
}
