// Elements: made, found and changed only where something changed, so that a reader of the screen is not disturbed.

/** Makes an element: properties that begin with "on" are listeners, true and false set and remove an attribute. */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "value") element.value = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** The element with this id; a wrong id is a mistake in the page. */
export function byId(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no element "${id}"`);
  return element;
}

/** Sets the text of an element that says something else. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Sets an attribute that is another one; null removes it. */
export function setAttribute(element, name, value) {
  if (value === null || value === undefined) element.removeAttribute(name);
  else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
}

/** Shows or hides an element. */
export function show(element, isShown) {
  if (element.hidden === isShown) element.hidden = !isShown;
}

/** Writes a note beside a control: kind is "refused", "done", "warning" or empty. */
export function note(element, text, kind = "") {
  element.dataset.kind = kind;
  setText(element, text);
}

/** Options of a select, of [value, text]; keeps the chosen one where it stays. */
export function setOptions(select, options, chosen) {
  const signature = JSON.stringify(options);
  if (select.dataset.signature === signature) return;
  const before = chosen ?? select.value;
  select.dataset.signature = signature;
  select.replaceChildren(...options.map(([value, text]) => make("option", { value }, text)));
  if (options.some(([value]) => String(value) === String(before))) select.value = before;
}

/** A canvas with one pixel of its own for each of the screen: returns [context, width, height] in CSS pixels. */
export function sharpCanvas(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const ratio = Math.min(window.devicePixelRatio || 1, 3);
  const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== wide || canvas.height !== high) {
    canvas.width = wide;
    canvas.height = high;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return [context, width, height];
}

/** Calls `draw` at most once a frame, and not while the canvas cannot be seen. */
export function frames(canvas, draw) {
  let isDue = false;
  const run = () => {
    isDue = false;
    if (canvas.clientWidth > 0 && canvas.clientHeight > 0) draw();
  };
  const request = () => {
    if (isDue) return;
    isDue = true;
    requestAnimationFrame(run);
  };
  new ResizeObserver(request).observe(canvas);
  return request;
}
