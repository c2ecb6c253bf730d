// Quantities in SI, said in the units of the field.

const MINUS = "\u2212";
const SPACE = "\u202f";

/** A number with so many places, with a true minus sign; a dash for none. */
export function fixed(value, places) {
  if (!Number.isFinite(value)) return "–";
  const text = Math.abs(value).toFixed(places);
  return value < 0 && Number(text) !== 0 ? MINUS + text : text;
}

/** A number to so many significant digits, without zeros at its end. */
export function short(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e6 || size < 1e-4 ? size.toExponential(digits - 1) : String(Number(size.toPrecision(digits)));
  return value < 0 ? MINUS + text : text;
}

/** A time: "4.2 s", "3:07", "1:02:45". */
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  if (seconds < 60) return `${fixed(seconds, 1)} s`;
  const whole = Math.round(seconds);
  const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (value) => String(value).padStart(2, "0");
  return hours > 0 ? `${hours}:${two(minutes)}:${two(rest)}` : `${minutes}:${two(rest)}`;
}

/** A latency of so many nanoseconds. */
export function nanoseconds(value) {
  if (!Number.isFinite(value)) return "–";
  if (value < 1e3) return `${short(value, 3)} ns`;
  if (value < 1e6) return `${short(value / 1e3, 3)} µs`;
  return value < 1e9 ? `${short(value / 1e6, 3)} ms` : `${short(value / 1e9, 3)} s`;
}

/** A length in millimetres, or an angle in degrees. */
export function place(value, unit = "m", places = 3) {
  return unit === "rad" ? `${fixed((value * 180) / Math.PI, places)}°` : `${fixed(value * 1e3, places)} mm`;
}

/** A speed in mm/s or degrees a second. */
export function speed(value, unit = "m") {
  return unit === "rad" ? `${short((value * 180) / Math.PI, 3)} °/s` : `${short(value * 1e3, 4)} mm/s`;
}

/** A part of one, in percent. */
export function percent(value, places = 0) {
  return Number.isFinite(value) ? `${fixed(value * 100, places)} %` : "–";
}

/** How much of SI one unit is that people type: millimetres and degrees. */
export function unitScale(unit) {
  return unit === "rad" ? { name: "°", scale: Math.PI / 180 } : { name: "mm", scale: 1e-3 };
}

const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];

/** A value with its unit and an SI prefix: "12.5 mA". Ratios and words without one keep their number. */
export function engineering(value, unit = "", digits = 4) {
  if (!Number.isFinite(value)) return "–";
  if (!unit || unit === "1" || unit.includes("/") || unit.includes(" ")) return `${short(value, digits)}${unit && unit !== "1" ? SPACE + unit : ""}`;
  if (value === 0) return `0${SPACE}${unit}`;
  const size = Math.abs(value);
  const [factor, prefix] = PREFIXES.find(([limit]) => size >= limit * 0.9999999) ?? PREFIXES.at(-1);
  return `${short(value / factor, digits)}${SPACE}${prefix}${unit}`;
}

/** A time of day; with the date where it was not today. */
export function clock(seconds) {
  if (!Number.isFinite(seconds)) return "";
  const then = new Date(seconds * 1e3);
  const time = then.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit", hour12: false });
  if (then.toDateString() === new Date().toDateString()) return time;
  return `${then.getFullYear()}-${String(then.getMonth() + 1).padStart(2, "0")}-${String(then.getDate()).padStart(2, "0")} ${time}`;
}

/** A size of a file. */
export function bytes(value) {
  if (!Number.isFinite(value)) return "";
  if (value < 1024) return `${value} B`;
  return value < 1048576 ? `${fixed(value / 1024, 1)} KiB` : `${fixed(value / 1048576, 1)} MiB`;
}

/** The nearest 1, 2 or 5 times a power of ten that is not less. */
export function roundStep(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  const lead = value / power;
  return (lead <= 1.000001 ? 1 : lead <= 2.000001 ? 2 : lead <= 5.000001 ? 5 : 10) * power;
}
