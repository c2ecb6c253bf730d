// Holds what the page computes to what is right; page.sh puts its modules beside this file.

import assert from "node:assert/strict";
import test from "node:test";
import * as format from "./format.js";
import { frameSettings, kindOf, settings } from "./placement.js";
import { Flat, Orbit } from "./projection.js";
import { STRIDE, Trail } from "./trail.js";

test("quantities are said in the units of the field", () => {
  assert.equal(format.place(-0.0123456), "\u221212.346 mm");
  assert.equal(format.place(Math.PI / 2, "rad", 1), "90.0°");
  assert.equal(format.speed(0.16), "160 mm/s");
  assert.equal(format.percent(0.055, 1), "5.5 %");
  assert.equal(format.fixed(-0.0001, 2), "0.00");
  assert.deepEqual([4.25, 187, 3765].map(format.duration), ["4.3 s", "3:07", "1:02:45"]);
  assert.deepEqual([850, 14_100, 1_880_000].map(format.nanoseconds), ["850 ns", "14.1 µs", "1.88 ms"]);
  assert.equal(format.engineering(0.0125, "A"), "12.5\u202fmA");
  assert.equal(format.engineering(1 / 3, ""), "0.3333");
  assert.equal(format.place(NaN), "– mm");
});

test("a place that is written in part is counted from where the job lies", () => {
  const at = (values, placed) => settings("drawing", values, placed);
  assert.deepEqual(at({}, [-0.29, -0.19]), []);
  assert.deepEqual(at({ x: "-100" }, [-0.29, -0.19]), ['drawing.at=["-100 mm", "-190 mm"]']);
  assert.deepEqual(at({ y: "5" }), ['drawing.at=["0 mm", "5 mm"]']);
});

test("a step is 1, 2 or 5 times a power of ten", () => {
  assert.deepEqual([0.03, 1, 1.1, 2.1, 6, 76].map(format.roundStep), [0.05, 1, 2, 5, 10, 100]);
});

test("a drawing is placed by its keys, and a program by none", () => {
  const values = { x: "20", rotation: "15", scale: "150", power: "40", more: "layers.red.speed=20 mm/s\n\n order.by=file " };
  assert.deepEqual(settings(kindOf("Logo.SVG"), values), [
    'drawing.at=["20 mm", "0 mm"]', "drawing.scale=1.5", 'drawing.rotation="15 deg"', 'marking.power="40 %"',
    "layers.red.speed=20 mm/s", "order.by=file",
  ]);
  assert.deepEqual(settings(kindOf("plate.ngc"), { x: "20", line: "7", stroke: "3" }), ["marking.from_stroke=3", "marking.from_line=7"]);
  assert.equal(kindOf("a.toml", '#:schema x\n[letters]\ntext = "NASO"'), "letters");
  assert.deepEqual(settings("cloud", { y: "2.5" }), ['cloud.at=["0 mm", "2.5 mm", "0 mm"]']);
  assert.deepEqual(frameSettings({ pilot: "1" }), ["marking.frame=true", 'marking.frame_power="1 %"']);
  assert.deepEqual(frameSettings({}), ["marking.frame=true"]);
});

test("what is under the pointer stays there as the view is made larger", () => {
  for (const projection of [new Flat(), new Orbit()]) {
    projection.resize(800, 600);
    projection.fit({ lower: [0, 0, 0], upper: [0.2, 0.1, 0.05] }, 40);
    const [before, after] = [[0, 0], [0, 0]];
    projection.project(0.05, 0.08, 0.01, before);
    projection.zoomAt(...before, 3.7);
    projection.project(0.05, 0.08, 0.01, after);
    assert.ok(Math.hypot(before[0] - after[0], before[1] - after[1]) < 1e-6, projection.constructor.name);
  }
});

test("y goes up, and a fitted box is inside of the canvas", () => {
  const flat = new Flat();
  flat.resize(400, 400);
  flat.fit({ lower: [0, 0, 0], upper: [0.2, 0.1, 0] }, 20);
  const [low, high] = [[0, 0], [0, 0]];
  flat.project(0, 0, 0, low);
  flat.project(0.2, 0.1, 0, high);
  assert.deepEqual([...low, ...high].map(Math.round), [20, 290, 380, 110]);
  assert.deepEqual(flat.placeAt(20, 110).map((value) => Math.round(value * 1e6)), [0, 100000]);
});

test("a straight line is kept as its ends, and a circle as it is", () => {
  const line = new Trail();
  for (let index = 0; index <= 1000; index++) line.push(index * 1e-4, 0, 0, 1);
  assert.equal(line.count, 2);
  line.push(0.1, 1e-3, 0, 0);
  assert.equal(line.count, 3, "light that goes off begins a piece");
  const circle = new Trail();
  for (let index = 0; index <= 6283; index++) circle.push(0.01 * Math.cos(index / 1000), 0.01 * Math.sin(index / 1000), 0, 1);
  const v = circle.values;
  for (let index = 1; index < circle.count; index++) {
    const [a, b] = [(index - 1) * STRIDE, index * STRIDE];
    const middle = Math.hypot((v[a] + v[b]) / 2, (v[a + 1] + v[b + 1]) / 2);
    assert.ok(Math.abs(middle - 0.01) < 5e-6, `chord ${index} is ${(0.01 - middle) * 1e6} µm off`);
  }
});

test("a path of a long job stays within its memory", () => {
  const trail = new Trail();
  for (let index = 0; index < 900_000; index++) trail.push(index * 1e-5, (index % 2) * 1e-3, 0, 1);
  assert.ok(trail.count <= 400_000);
  assert.equal(trail.values[(trail.count - 1) * STRIDE], 899_999 * 1e-5, "its newest end is kept");
});
