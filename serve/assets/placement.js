// The settings of a job as a form: where it lies and how it is marked, as `KEY=VALUE` of the job file.

import { make } from "./dom.js";

const DRAWINGS = ["svg", "svgz", "dxf", "lbrn2", "lbrn", "plt", "hpgl", "hpg", "hgl"];
const IMAGES = ["png", "jpg", "jpeg", "bmp", "gif", "webp", "tif", "tiff"];

/** What kind of job a file is: "drawing", "image", "program", or of a job file the name of its table, else "file". */
export function kindOf(name, text = "") {
  const extension = name.toLowerCase().split(".").pop();
  if (DRAWINGS.includes(extension)) return "drawing";
  if (IMAGES.includes(extension)) return "image";
  if (extension !== "toml") return "program";
  const table = /^\s*\[(letters|points|cloud|path|drawings?|gcode)\b/m.exec(text)?.[1];
  return table === "drawing" ? "drawing" : table === "gcode" ? "program" : (table ?? "file");
}

/** The key of a place from home, for kinds that have one. */
const AT = { drawing: "drawing.at", image: "drawing.at", letters: "letters.at", cloud: "cloud.at", path: "path.at" };

const ANCHORS = ["center", "lower_left", "lower", "lower_right", "left", "right", "upper_left", "upper", "upper_right", "page"];

/** A text as a TOML string. */
function quoted(text) {
  return JSON.stringify(String(text));
}

const length = (value) => `${Number(value)} mm`;

/** The fields of a kind: name, label, unit, and the settings that a value means. */
function fieldsOf(kind) {
  const fields = [];
  if (AT[kind]) {
    fields.push({ name: "x", label: "Offset x", unit: "mm", group: "Place, from home" });
    fields.push({ name: "y", label: "Offset y", unit: "mm", group: "Place, from home" });
  }
  if (AT[kind] === "drawing.at") {
    const group = "Place, from home";
    fields.push({ name: "scale", label: "Scale", unit: "%", group, set: (v) => [`drawing.scale=${Number(v) / 100}`] });
    fields.push({ name: "rotation", label: "Rotation", unit: "°", group, set: (v) => [`drawing.rotation=${quoted(`${Number(v)} deg`)}`] });
    fields.push({ name: "anchor", label: "Anchor", options: ANCHORS.map((it) => [it === "center" ? "" : it, it.replace("_", " ")]), group, set: (v) => [`drawing.anchor=${quoted(v)}`] });
    fields.push({ name: "mirror", label: "Mirror", options: [["", "none"], ["x", "left and right"], ["y", "top and bottom"]], group, set: (v) => [`drawing.mirror=${quoted(v)}`] });
  }
  const group = "Marking";
  fields.push({ name: "speed", label: "Speed", unit: "mm/s", placeholder: kind === "program" ? "F" : "optimum", group, set: (v) => [`marking.speed=${quoted(`${Number(v)} mm/s`)}`] });
  if (kind !== "program") fields.push({ name: "power", label: "Power", unit: "%", placeholder: "100", max: 100, group, set: (v) => [`marking.power=${quoted(`${Number(v)} %`)}`] });
  fields.push({ name: "tolerance", label: "Tolerance", unit: "µm", placeholder: "machine's", group, set: (v) => [`marking.tolerance=${quoted(`${Number(v)} um`)}`] });
  fields.push({ name: "policy", label: "Light", options: [["", "as the job says"], ["constant", "constant speed"], ["proportional", "by the speed"]], group, set: (v) => [`marking.policy=${quoted(v)}`] });
  fields.push({ name: "stroke", label: "From stroke", placeholder: "1", group, set: (v) => [`marking.from_stroke=${Math.round(Number(v))}`] });
  if (kind === "program") fields.push({ name: "line", label: "From line", placeholder: "1", group, set: (v) => [`marking.from_line=${Math.round(Number(v))}`] });
  fields.push({ name: "pilot", label: "Frame power", unit: "%", placeholder: "dark", max: 100, group });
  return fields;
}

function control(field, value) {
  if (field.options) {
    const select = make("select", { name: field.name }, ...field.options.map(([key, text]) => make("option", { value: key }, text)));
    select.value = value ?? "";
    return select;
  }
  const input = make("input", { name: field.name, type: "number", step: "any", placeholder: field.placeholder ?? (field.name === "scale" ? "100" : "0"), max: field.max, value: value ?? "" });
  return field.unit ? make("span", { class: "unit" }, input, make("span", {}, field.unit)) : input;
}

/** Fills the form for a kind of job, with what was chosen before. */
export function buildForm(form, kind, values) {
  const groups = new Map();
  for (const field of fieldsOf(kind)) {
    if (!groups.has(field.group)) groups.set(field.group, []);
    groups.get(field.group).push(make("label", {}, field.label, control(field, values[field.name])));
  }
  const parts = [...groups].map(([name, labels]) => make("fieldset", {}, make("legend", {}, name), ...labels));
  if (!AT[kind]) {
    const words = kind === "program"
      ? "A program lies where its work coordinate system has its origin: graver offset here g54."
      : "A job file says where its parts lie; give its keys below to change them.";
    parts.unshift(make("p", { class: "dim all" }, words));
  }
  const more = make("textarea", { name: "more", rows: 2, spellcheck: "false", placeholder: "layers.red.speed=20 mm/s" });
  more.value = values.more ?? "";
  parts.push(make("label", { class: "all" }, "Further keys, one KEY=VALUE a line", more));
  form.replaceChildren(...parts);
}

/** What stands in the form, by name; empty fields are left out. */
export function readForm(form) {
  return Object.fromEntries([...new FormData(form)].filter(([, value]) => String(value).trim() !== ""));
}

/** Whether these values say where the job lies. */
export function saysPlace(values) {
  return values.x !== undefined || values.y !== undefined;
}

/** The settings that these values mean, of a job that lies at `placed` from home [m] where they say no place. */
export function settings(kind, values, placed = null) {
  const set = [];
  if (AT[kind] && saysPlace(values)) {
    const at = (name, axis) => quoted(length(values[name] ?? (placed?.[axis] ?? 0) * 1e3));
    const rest = kind === "cloud" || kind === "path" ? ', "0 mm"' : "";
    set.push(`${AT[kind]}=[${at("x", 0)}, ${at("y", 1)}${rest}]`);
  }
  for (const field of fieldsOf(kind)) {
    const value = values[field.name];
    if (value !== undefined && field.set) set.push(...field.set(value));
  }
  const more = (values.more ?? "").split("\n").map((line) => line.trim());
  return [...set, ...more.filter((line) => line !== "")];
}

/** What makes a frame of the job: in the dark, or with pilot light. */
export function frameSettings(values) {
  const pilot = Number(values.pilot ?? 0);
  return ["marking.frame=true", ...(pilot > 0 ? [`marking.frame_power=${quoted(`${pilot} %`)}`] : [])];
}
