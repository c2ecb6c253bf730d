// The two ways to the machine: requests over HTTP, and the live connection, which is made anew whenever it is lost.

const FIRST_DELAY = 300;
const LONGEST_DELAY = 4000;
/** A server says something each second; after this long without a word the connection is taken for lost [ms]. */
const SILENCE = 3000;

const listeners = new Map();
let socket = null;
let delay = FIRST_DELAY;
let lastWord = 0;
let isOpen = false;

/** Calls `listener` with each message of this type; "link" tells {open}, "silent" a pipeline that does not answer, "scope"
 * a binary picture. */
export function on(type, listener) {
  if (!listeners.has(type)) listeners.set(type, []);
  listeners.get(type).push(listener);
}

/** Tells a message to those who listen; one that fails does not keep it from the others. */
export function emit(type, message) {
  for (const listener of listeners.get(type) ?? []) {
    try {
      listener(message);
    } catch (error) {
      console.error(`while ${type} was shown:`, error);
    }
  }
}

/** Sends a message to the server; false where there is no connection. */
export function send(message) {
  if (!isOpen || socket.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify(message));
  return true;
}

/** Whether messages come. */
export function isLinked() {
  return isOpen;
}

function heard(event) {
  lastWord = performance.now();
  if (typeof event.data !== "string") {
    const picture = readPicture(event.data);
    if (picture) emit("scope", picture);
    return;
  }
  let message;
  try {
    message = JSON.parse(event.data);
  } catch {
    console.error("a message that is no JSON:", event.data.slice(0, 200));
    return;
  }
  if (message.type === "hello") message.machine ??= {};
  // A server whose pipeline does not answer says so in the place of a status.
  if (message.type === "status" && !message.status) emit("silent", message);
  else emit(message.type, message);
}

/** A binary message: length of the header, the header as JSON, then a block of numbers for each signal. */
function readPicture(buffer) {
  if (buffer.byteLength < 4) return null;
  const length = new DataView(buffer).getUint32(0, true);
  if (4 + length > buffer.byteLength) return null;
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const body = buffer.slice(4 + length);
  const count = Math.min(header.samples, Math.floor(body.byteLength / 4 / Math.max(1, header.signals.length)));
  const traces = header.signals.map((_, index) => new Float32Array(body, index * count * 4, count));
  return { ...header, samples: count, traces };
}

function lost() {
  if (socket) {
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    socket = null;
  }
  const wasOpen = isOpen;
  isOpen = false;
  const wait = delay;
  delay = Math.min(delay * 1.7, LONGEST_DELAY);
  emit("link", { open: false, wasOpen, wait });
  setTimeout(connect, wait);
}

/** Opens the live connection, and keeps it. */
export function connect() {
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  const opening = new WebSocket(`${scheme}//${location.host}/api/v1/live`);
  socket = opening;
  opening.binaryType = "arraybuffer";
  opening.onopen = () => {
    lastWord = performance.now();
    delay = FIRST_DELAY;
    isOpen = true;
    emit("link", { open: true });
  };
  opening.onmessage = heard;
  opening.onclose = () => {
    if (socket === opening) lost();
  };
}

setInterval(() => {
  if (isOpen && performance.now() - lastWord > SILENCE) lost();
}, 500);

/** Asks over HTTP and returns what the answer says; an error has the server's words and its status. */
export async function http(method, path, body, type = "application/json") {
  const isJson = type === "application/json";
  const options = { method, headers: {}, credentials: "same-origin" };
  if (body !== undefined) {
    options.headers["Content-Type"] = type;
    options.body = isJson ? JSON.stringify(body) : body;
  }
  let answer;
  try {
    answer = await fetch(`/api/v1/${path}`, options);
  } catch {
    throw new Error("the server does not answer");
  }
  const text = await answer.text();
  let value = null;
  try {
    value = text ? JSON.parse(text) : null;
  } catch {
    if (answer.ok) throw new Error("the server's answer cannot be read");
  }
  if (!answer.ok) {
    const error = new Error(value?.error ?? `the server answers ${answer.status} ${answer.statusText}`.trim());
    error.status = answer.status;
    throw error;
  }
  return value;
}
