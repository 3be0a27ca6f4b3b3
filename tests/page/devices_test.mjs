// SPDX-License-Identifier: MIT
// What devices declare, on the page in a browser: each input can be set, each output and curve is seen.
// usage: node devices_test.mjs CBCAN_SIM SOURCE_FOLDER FOLDER
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { click, looker, shows, startPlant } from "./browser.mjs";

const [program, source, folder] = process.argv.slice(2);
const { look: lookAt } = await looker(folder);
const look = (name, options, use) => lookAt(name, () => startPlant(program, ["--clock", "manual", ...options]), use);

const points = async (plant, node) => (await (await fetch(`${plant.url}/api/nodes/${node}/points`)).json()).points;

/// Waits until the device has the value.
async function has(plant, node, { kind, object }, test) {
  for (let turn = 0; turn < 500; ++turn)
    if (test((await points(plant, node)).find((point) => point.kind === kind && point.object === object).value)) return;
  assert.fail(`node ${node}: ${kind} ${object} does not get the value`);
}

async function switchEach(page, plant, node, point) {
  for (const [bit, name] of point.bits.entries())
    for (const on of [1, 0]) {
      await (await page.waitForSelector(`#node-panel input[aria-label="${point.name}: ${name}"]`)).evaluate((box) => box.click());
      await has(plant, node, point, (value) => (value >> bit & 1) === on);
    }
}

async function slide(page, plant, node, point) {
  const { low = 0, high = 100 } = point;
  for (const [label, value] of [[point.name, Math.round(low + (high - low) / 4)], [`${point.name}, as a number`, Math.round(low + (high - low) / 2)]]) {
    await (await page.waitForSelector(`#node-panel input[aria-label="${label}"]`)).evaluate((input, wanted) => {
      input.value = wanted;
      input.dispatchEvent(new Event("change"));
    }, value);
    await has(plant, node, point, (now) => Math.abs(now - value) < 1e-6);
  }
}

async function seesEachLamp(page, plant, node, point) {
  const [index, sub] = point.object.split(":");
  for (let bit = 0; bit < point.bits.length; ++bit) {
    await plant.control(`trigger write ${node} ${index} ${sub} 1 ${1 << bit}`, "pass 20ms");
    await page.waitForSelector(`#node-panel .lamp.on[aria-label="${point.name}: ${point.bits[bit]} on"]`);
    assert.equal((await page.$$(`#node-panel [data-point="output ${point.object}"] .lamp.on`)).length, 1);
  }
}

const sees = (page, point) => page.waitForFunction((name, value) =>
  Number(document.querySelector(`#node-panel [role=meter][aria-label="${name}"]`)?.ariaValueNow) === value, {}, point.name, point.value);

/// Uses each control of a node; returns how many there were of each kind.
async function useEach(page, plant, node, name) {
  const used = { switches: 0, sliders: 0, lamps: 0, gauges: 0, curves: 0 };
  await click(page, "#node-list .tile", name);
  for (const point of await points(plant, node)) {
    if (point.kind === "input" && point.bits) await switchEach(page, plant, node, point), used.switches += point.bits.length;
    else if (point.kind === "input") await slide(page, plant, node, point), ++used.sliders;
    else if (point.kind === "curve") {
      await click(page, "#node-panel .curves button, #node-panel button.name", point.name);
      await shows(page, "#legend", new RegExp(point.name));
      ++used.curves;
    } else if (point.bits) await seesEachLamp(page, plant, node, point), used.lamps += point.bits.length;
    else await sees(page, (await points(plant, node)).find((now) => now.object === point.object && now.kind === "output")), ++used.gauges;
  }
  return used;
}

look("each control of each kind of device", [], async (page, plant) => {
  await plant.control("nmt start all", "pass 10ms");
  assert.deepEqual(await useEach(page, plant, 66, "I/O module"), { switches: 8, sliders: 2, lamps: 8, gauges: 2, curves: 0 });
  await click(page, "#node-panel button.name", "analogue output 2");
  await shows(page, "#legend", /analogue output 2/);
  assert.deepEqual(await useEach(page, plant, 1, "Pressure transducer 1"), { switches: 0, sliders: 1, lamps: 0, gauges: 0, curves: 0 });
  await plant.control(...[6, 7, 15].flatMap((word) => [`trigger write 16 0x6040 0 2 ${word}`, "pass 20ms"]), "trigger write 16 0x6060 0 1 1", "pass 20ms",
    "trigger write 16 0x607A 0 4 30000 0", "pass 20ms", "trigger write 16 0x6040 0 2 31", "pass 20s");
  assert.deepEqual(await useEach(page, plant, 16, "Drive"), { switches: 0, sliders: 0, lamps: 0, gauges: 1, curves: 4 });
  assert.equal(await page.$eval("#node-panel .axis b", (mark) => mark.style.left), await page.$eval("#node-panel .axis i", (fill) => fill.style.width));
  assert.deepEqual(await useEach(page, plant, 32, "Generic node"), { switches: 0, sliders: 0, lamps: 0, gauges: 0, curves: 0 });
});

/// The lines that the page sends; Send accepts each.
const lines = (page) => page.evaluate(async () => { (await import("./state.js")).on("command", (line) => (window.lines ??= []).push(line)); });

for (const timing of ["at-once", "typical"]) for (const [title, verdict] of [["Read", /read node 66 1000h:00.*done/],
  ["Move the drive", /write node 16 6040h:00 Controlword = 001Fh.*done/], ["Break something", /read node 66 1000h:00.*0504 0000h/]])
  look(`a first visitor: ${title}, ${timing}`, ["--timing", timing], async (page, plant) => {
    await plant.control("pass 3s");  // nodes boot
    await lines(page);
    await click(page, "#diagram .trial", title);
    if (title === "Move the drive") await shows(page, "#verdict", verdict);
    await shows(page, "#answer", /ok/);
    await plant.control("pass 5s");
    await shows(page, "#verdict", verdict);
    for (const line of new Set(await page.evaluate(() => window.lines))) {
      await page.$eval("#command", (field, text) => { field.value = text; }, line);
      await click(page, "#command-form button", "Send");
      await page.waitForFunction(() => document.querySelector("#answer").textContent !== "…");
      assert.doesNotMatch(await page.$eval("#answer", ({ title: text }) => text), /error/, line);
      if (title !== "Move the drive") await plant.control("pass 3s");
    }
    const position = (await points(plant, 16)).find((point) => point.name === "position");
    assert.equal(position.value, title === "Move the drive" ? 60000 : 0);
    if (title === "Move the drive") await sees(page, position);
  });

// ---- A plant that this project does not ship

const SCRIPT = `
device = { name = "Kiln" }
objects = {
  { index = 0x2100, name = "setpoint", type = "u16", default = 900 },
  { index = 0x2101, name = "temperature", type = "f32", access = "ro", default = 20, unit = "°C", low = -50, high = 1300, target = 0x2100, show = { "output", "curve" } },
  { index = 0x2102, name = "gas", type = "u8", access = "ro", unit = "%", high = 100, show = "input" },
  { index = 0x2103, name = "doors", type = "u8", access = "ro", bits = { "front", "rear", "flue" }, show = "input" },
  { index = 0x2104, name = "alarms", type = "u8", bits = { "hot", "open" }, show = "output" },
  { index = 0x2105, name = "glaze", type = "u16", access = "ro", default = 400, unit = "l", high = 500, level = true, show = "output" },
}
incidents = { "flame-out" }
function update(now) set(0x2101, 0, 20 + 8 * get(0x2102)) end
function set_input(index, sub, value) set(index, sub, value) return true end
`;
const FILES = { "kiln.lua": SCRIPT, "kiln.toml": `
[[node]]
id = 66
name = "Terminals"
eds = "${source}/plants/demo/io_module.eds"
[[node]]
id = 9
name = "Kiln"
device = "kiln.lua"
[[wire]]
from = "66:output:2"
to = "9:0x2102"
scale = 40
` };

for (const [name, text] of Object.entries(FILES)) writeFileSync(`${folder}/${name}`, text);
look("a kiln in Lua with wires to terminals", ["--config", `${folder}/kiln.toml`], async (page, plant) => {
  assert.deepEqual(await useEach(page, plant, 9, "Kiln"), { switches: 3, sliders: 1, lamps: 2, gauges: 2, curves: 1 });
  await plant.control("trigger write 66 0x6200 1 1 2", "pass 20ms");
  await sees(page, { name: "temperature", value: 20 + 8 * 40 });
  const shares = await page.$$eval("#node-panel [role=meter] i", (fills) => fills.map((fill) => fill.style));
  assert.equal(shares.length, 2);
  assert.equal(await page.$eval("#node-panel .level i", (fill) => fill.style.height), "80%");
  const mark = Number.parseFloat(await page.$eval("#node-panel .axis b", (element) => element.style.left));
  assert.ok(Math.abs(mark - 100 * (900 + 50) / 1350) < 0.01, `${mark}`);
  await click(page, "#node-panel .switch", "flame-out");
  await shows(page, "#answer", /^ok/);
  await click(page, "#node-panel button", "0x2102 ← 66:output:2");
  await shows(page, "#node-title", /66 Terminals/);
  await shows(page, "#node-panel", /output:2 → 9:0x2102/);
});

// ---- The shelf

writeFileSync(`${folder}/shelf.toml`, [[6, "cia406"], [8, "cia408"], [10, "cia410"]].map(([id, device]) =>
  `[[node]]\nid = ${id}\nname = "${device}"\ndevice = "${device}"`).join("\n"));
look("an encoder, a valve and an inclinometer", ["--config", `${folder}/shelf.toml`], async (page, plant) => {
  const lamp = (name) => page.waitForSelector(`#node-panel .lamp.on[aria-label="${name} on"]`);
  const inputs = async (node, name) => {
    await click(page, "#node-list .tile", name);
    const found = (await points(plant, node)).filter(({ kind }) => kind === "input");
    for (const point of found) await slide(page, plant, node, point);
    return found.length;
  };
  assert.equal(await inputs(6, "cia406"), 1);
  await click(page, "#node-panel .switch", "sensor-break");
  await plant.control("pass 20ms");
  await lamp("alarms: position");
  assert.equal(await inputs(10, "cia410"), 2);
  assert.equal(await inputs(8, "cia408"), 0);
  await plant.control(...[1, 3, 7].flatMap((word) => [`trigger write 8 0x6040 0 2 ${word}`, "pass 20ms"]), "trigger write 8 0x6300 1 2 8192", "pass 1s");
  for (const name of ["disabled", "hold", "active", "ready"]) await lamp(`status word: ${name}`);
  await sees(page, { name: "actual value: value", value: 8192 });
  assert.equal(await page.$eval("#lanes", (lanes) => lanes.hidden), true);  // its 6041h is not that of a drive
});
