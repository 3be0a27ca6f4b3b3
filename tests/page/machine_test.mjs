// SPDX-License-Identifier: MIT
// The plant on the page: states, values, failed boots, plots; advice to the PLC's programmer.
// usage: node machine_test.mjs CBCAN_SIM SOURCE_FOLDER FOLDER
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { click, drive, looker, shows, startPlant } from "./browser.mjs";
import { coloured, outside, pale, scrolled } from "./inspect.mjs";

const [program, source, shots] = process.argv.slice(2);
const { look: lookAt } = await looker(shots);
const look = (name, options, use) => lookAt(name, () => startPlant(program, ["--clock", "manual", ...options]), use);

const crowd = (count) => Array.from({ length: count }, (_, at) => `[[node]]\nid = ${at + 1}\nname = "Station ${at + 1}"\neds = "${source}/plants/demo/io_module.eds"\n`).join("");
for (const [name, text] of [["hundred", crowd(100)], ["nineteen", crowd(19)]]) writeFileSync(`${shots}/${name}.toml`, text);
/// States come in parts, and are drawn in a later frame.
const counts = (page, ...wanted) => page.waitForFunction((texts) => texts ===
  JSON.stringify([...document.querySelectorAll("#counts button:not([hidden])")].map((pill) => pill.textContent)), {}, JSON.stringify(wanted));

look("a hundred nodes are a map, counted by state, the worst first", ["--config", `${shots}/hundred.toml`], async (page, plant) => {
  await plant.control("nmt start all", "power 30 off", "power 31 off", "nmt stop 40");
  await counts(page, "X · 2 off", "T · 1 stopped", "O · 97 operational");
  const tiles = () => page.$$eval("#node-list .tile", (all) => all.map((tile) => tile.textContent));
  assert.deepEqual((await tiles()).slice(0, 5), ["30X", "31X", "40T", "1O", "2O"]);
  assert.equal((await tiles()).length, 100);
  assert.deepEqual(await page.evaluate(scrolled), []);
  for (const value of ["light", "dark"]) {
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value }, { name: "prefers-reduced-motion", value: "reduce" }]);
    assert.deepEqual(await page.evaluate(pale), []);
    assert.deepEqual(await page.evaluate(outside), []);
  }
  assert.equal(await page.$eval("#node-list .tile", (tile) => tile.ariaLabel), "30 Station 30, off");
  await click(page, "#counts button", "off");
  assert.deepEqual(await tiles(), ["30X", "31X"]);
  await click(page, "#node-list .tile", "31");
  await shows(page, "#node-title", /31 Station 31/);
  await plant.control("power 30 on", "power 31 on", "nmt start all");  // none is left to be shown alone
  await page.waitForFunction(() => document.querySelectorAll("#node-list .tile").length === 100);
  await counts(page, "O · 100 operational");
});

look("a node that misses two heartbeats is silent", [], async (page, plant) => {
  await plant.control("trigger write 66 0x1017 0 2 100", "pass 10ms", "trigger write 32 0x1017 0 2 100", "pass 1s", "power 32 off", "fault 66 silent", "pass 190ms");
  await page.waitForFunction(async () => (await import("./state.js")).state.about.time > 1.19);
  await counts(page, "1 off", "4 pre-operational");
  await plant.control("pass 120ms");
  await shows(page, "#node-list .tile.bad", /^66 I\/O modulesilent *heard now/);
  await counts(page, "1 silent", "1 off", "3 pre-operational");
});

look("less than twenty nodes are tiles with their values", ["--config", `${shots}/nineteen.toml`], async (page, plant) => {
  await plant.control("nmt start all", "trigger write 19 0x6411 1 2 300", "pass 1ms", "trigger write 19 0x6200 1 1 5");
  await page.waitForFunction(() => [...document.querySelectorAll("#node-list .tile")].at(-1).textContent.includes("analogue output 1 300"));
  const last = "#node-list .tile:last-child";
  await page.waitForSelector(`${last} .lamp.on[aria-label='outputs 1 to 8: 3 on']`);
  assert.equal((await page.$$(`${last} .lamp.on`)).length, 2);
});

writeFileSync(`${shots}/network.toml`, `${["66", "77"].map((id) => `[[node]]\nid = ${id}\neds = "${source}/plants/demo/io_module.eds"\ndevice_type = 0x00020192\n`).join("")}`);
const REASON = "device type 000F0191h, the network file wants 00020192h (C); it is not started";

look("a node whose boot has failed is red, with the words, and so is one that is not there", ["--network-file", `${shots}/network.toml`], async (page, plant) => {
  await plant.control("pass 10s");
  await page.waitForFunction(() => document.querySelectorAll("#node-list .tile.bad").length === 2);
  await counts(page, "1 failed", "1 missing", "4 pre-operational");
  await shows(page, "#node-list .tile.bad", /^66 I\/O modulefailed *device type 000F0191h, the network file wants 00020192h \(C\); it is not started/);
  await page.waitForFunction((words) => words === [...document.querySelectorAll("#event-list .row .bad.whole")].map((part) => part.textContent).join(""),
    {}, REASON + "no response (B); it is looked for each second");
  for (const part of await page.$$("#event-list .row .whole"))
    assert.ok(await part.evaluate((whole) => whole.scrollWidth <= whole.clientWidth));
  assert.deepEqual(await page.evaluate(outside), []);
  assert.deepEqual(await page.evaluate(pale), []);
  await click(page, "#node-list .tile.bad", "66 I/O module");
  await shows(page, "#node-about", /it is not started/);
  await plant.control("nmt start 66");
  await page.waitForFunction(() => document.querySelectorAll("#node-list .tile.bad").length === 1);
});

look("advice is beside its transaction, with its count", [], async (page, plant) => {
  const plc = await plant.plc(), read = (node) => plc.request(16, 3700, 0xCA0E, 5055, node, 0x1000, 0, 4);
  for (const node of [99, 66, 66, 16]) await read(node);
  const words = /Advice not executed: #1 \(read node 99 1000h:00\) is in progress; wait until R3700 is no longer CA0Eh; 3 times$/;
  await plant.control("pass 1100ms");
  await shows(page, "#verdict", /#1 /);
  await shows(page, "#advice", words);
  await shows(page, "#event-list", /advice *not executed: #1/);
  assert.deepEqual(await page.evaluate(outside), []);
  assert.deepEqual(await page.evaluate(pale), []);
  assert.deepEqual(await plc.request(3, 3700, 1), [4]);
  await read(66);
  await plant.control("pass 1ms");
  await shows(page, "#verdict", /#2 /);
  await shows(page, "#advice", /^$/);
  await click(page, "#event-list .row", "is no longer CA0Eh");
  assert.ok(await page.evaluate(async () => { const { state } = await import("./state.js"); return state.cursor === state.notes[0].time; }));
  await shows(page, "#advice", words);
  plc.close();
});

/// Looks at each picture that the page draws.
async function until(page, isSo) {
  for (let turn = 0; !await isSo(); ++turn) {
    assert.ok(turn < 500);
    await page.evaluate(() => new Promise(requestAnimationFrame));
  }
}

look("a plot holds a value until it changes", [], async (page, plant) => {
  await click(page, "#node-list .tile", "I/O module");
  await shows(page, "#legend", /analogue input 1 *0/);
  await plant.control("pass 5s");
  await plant.control("set 66 0x6401:1 1000", "pass 5s");
  await shows(page, "#legend", /analogue input 1 *1000/);
  await plant.control("pass 5s");
  const at = (share) => page.evaluate(coloured, "#plot", share);
  await until(page, async () => (await at(0.9)).some((height) => height < 0.2));
  const before = await at(0.25);
  assert.ok(before.length > 0 && before.every((height) => height > 0.95), `${before}`);
  for (const [name, shown] of [["Drive", /position demand/], ["I/O module", /analogue input 1/]]) {  // the curve stays
    await click(page, "#node-list .tile", name);
    await shows(page, "#legend", shown);
  }
  await until(page, async () => (await at(0.25)).length > 0);
});

look("red means bad: a fault's lane only while there is one, a lamp if it reports an alarm", [], async (page, plant) => {
  const red = async () => (await page.evaluate(coloured, "#lanes", 0.9, true)).length;
  await drive(plant);
  await page.waitForFunction(() => document.querySelectorAll("#legend b")[1].textContent === "60000");
  assert.equal(await red(), 0);
  await plant.control("incident 16 limit-switch-positive on", "pass 1s");
  await shows(page, "#node-list", /position 60000 inc *limit-switch-positive/);
  assert.equal((await page.$$("#node-list .alarm")).length, 0);
  await plant.control("incident 16 overcurrent on", "pass 10s");
  await page.waitForSelector("#node-list .tile.alarm");
  await plant.control("pass 10s");
  await until(page, async () => await red() > 0);
});
