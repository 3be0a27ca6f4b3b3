// SPDX-License-Identifier: MIT
// What the page has in the tab alone.
// usage: node tab_test.mjs CBCAN_SIM SOURCE_FOLDER SCREENSHOT_FOLDER TAB_FOLDER
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";
import { addressOf, click, looker, open, serveFolder, shows, tabPlant, text } from "./browser.mjs";
import { count } from "./cases.mjs";

const [program, source, shots, tab] = process.argv.slice(2);
const { browser, look: lookAt } = await looker(shots);
const site = await serveFolder(tab);
const read = (name, encoding = "utf8") => readFileSync(join(source, name), encoding);

const look = (name, use, { address = "", url = site, meant } = {}) => lookAt(name, () => tabPlant(url + address), use, { meant });

/// Drops files, {name: bytes or text}, on the page.
const dropped = (page, files) => page.evaluate((entries) => {
  const dataTransfer = new DataTransfer();
  for (const [name, bytes] of entries) dataTransfer.items.add(new File([new Uint8Array(bytes)], name));
  for (const kind of ["dragover", "drop"]) document.body.dispatchEvent(new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true }));
}, Object.entries(files).map(([name, content]) => [name, [...Buffer.from(content)]]));

/// Waits until the page has loaded the plant of its new address.
async function renewed(page, act) {
  await page.evaluate(() => { window.isOld = true; });
  await act();
  await page.waitForFunction(() => !window.isOld && document.querySelector("#live")?.textContent === "live" && document.querySelector("#node-list .tile"));
}

const nodes = async (plant, network = 1) => JSON.parse(await plant.ask(`api/nodes?network=${network}`)).nodes.map(({ node, name }) => `${node} ${name}`);
const demo = ["66 I/O module", "1 Pressure transducer 1", "2 Pressure transducer 2", "16 Drive", "32 Generic node"];

/// As a command line of the page.
async function send(page, line, answer = /^ok/) {
  await page.$eval("#command", (field, value) => { field.value = value; }, line);
  await click(page, "#command-form button", "Send");
  await shows(page, "#answer", answer);
}

test("it has what it needs, and a licence", () => {
  count();
  const files = readdirSync(tab, { recursive: true }).filter((name) => statSync(join(tab, name)).isFile());
  console.log(`figure: the folder has ${files.reduce((sum, name) => sum + statSync(join(tab, name)).size, 0)} bytes in ${files.length} files`);
  for (const name of files.filter((file) => /\.(html|css|js)$/.test(file)))
    assert.ok(!/(?:src|href)="\/|from '\//.test(readFileSync(join(tab, name), "utf8")), name);
  for (const name of ["Lua", "fmt", "toml++", "uPlot"]) assert.match(readFileSync(join(tab, "LICENSE"), "utf8"), new RegExp(name.replace("++", "\\+\\+")));
});

look("a transaction that is done, one that aborts, and a node that starts", async (page, plant) => {
  console.log(`figure: live after ${Math.round(await page.evaluate(() => performance.now()))} ms`);
  await send(page, "trigger write 0x42 0x6411 1 2 300");
  await shows(page, "#verdict", /#1 +write node 66 6411h:01 .* = 300done/);
  await send(page, "trigger read 0x42 0x6411 1 2");
  await shows(page, "#verdict", /#2 +read node 66 6411h:01 .* = 300done/);
  await send(page, "trigger read 0x20 0x3333 0 4");
  await shows(page, "#verdict", /#3 +read node 32 3333h:00.*0602 0000h/);
  await shows(page, "#diagram", /620 · 40 33 33 00 00 00 00 00[^]*5A0 · 80 33 33 00 00 00 02 06/);
  await send(page, "nmt start 0x42");
  await shows(page, "#node-list", /I\/O module *operational/);
  const { events } = JSON.parse(await plant.ask("api/frames"));
  const frames = events.map(({ frame }) => frame);  // among those of the network's boot
  assert.deepEqual(frames.filter((frame) => /^(642|5C2)#..1164|^(620|5A0)#..3333/.test(frame)), ["642#2B1164012C010000", "5C2#6011640100000000",
    "642#4011640100000000", "5C2#4B1164012C010000", "620#4033330000000000", "5A0#8033330000000206"]);
  for (const frame of ["000#0142", "1C2#00", "2C2#00000000"]) assert.ok(frames.includes(frame), frame);
});

look("nothing inline, nothing from elsewhere", async (page) => {
  assert.equal(await page.$eval("meta[http-equiv=Content-Security-Policy]", ({ content }) => content),
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'");
  await page.evaluate(() => { document.body.append(Object.assign(document.createElement("script"), { textContent: "window.inline = true" })); });
  assert.equal(await page.evaluate(() => window.inline), undefined);
  assert.equal(page.errors.length, 1);
}, { meant: [/inline script/] });

look("another plant is chosen", async (page, plant) => {
  await renewed(page, () => page.select("#chooser", "plants/tank.toml"));
  assert.equal(await page.evaluate(() => location.hash), "#plants/tank.toml");
  assert.deepEqual(await nodes(plant), ["66 I/O module", "20 Tank"]);
  await send(page, "nmt start all");
  await send(page, "trigger write 66 0x6200 1 1 1");
  await send(page, "wait object 66 0x6401:1 >= 1600 within 10s");
  await renewed(page, () => page.select("#chooser", "demo"));
  assert.deepEqual(await nodes(plant), demo);
});

test("scenarios pass, on the plant that the page then has, with the frames of cbcan-sim", async () => {
  count();
  const logs = mkdtempSync(join(tmpdir(), "logs-"));
  execFileSync(program, ["run", join(source, "scenarios"), "--log", logs]);
  const plant = tabPlant(site);
  const page = await open(browser, plant);
  const scenarios = readdirSync(join(source, "scenarios"));
  try {
    for (const scenario of scenarios) {
      await renewed(page, () => page.select("#chooser", `scenarios/${scenario}`));
      assert.match(await text(page, "#message"), new RegExp(`^passed scenarios/${scenario}: \\d+\\.\\d+ s`));
      for (const network of scenario === "two_networks.toml" ? [1, 2] : [1]) {
        const log = readFileSync(join(logs, scenario.replace("toml", network === 1 ? "log" : "2.log")), "utf8").trim().split("\n");
        const { events } = JSON.parse(await plant.ask(`api/frames?network=${network}`));
        const frames = events.map(({ time, frame }) => `(${time.toFixed(6).padStart(17, "0")}) virtual ${frame}`);
        assert.ok(frames.length > 0);
        assert.deepEqual(frames, log.slice(-frames.length), scenario);
      }
    }
    const offered = await page.$$eval('#chooser option[value^="scenarios/"]', (options) => options.map(({ value }) => value));
    assert.deepEqual(offered.sort(), scenarios.map((name) => `scenarios/${name}`).sort());
    assert.deepEqual(page.errors, []);
  } finally {
    await page.close();
    rmSync(logs, { recursive: true });
  }
});

look("a scenario that fails, and one with a mistake", async (page, plant) => {
  const silent = read("scenarios/silent_node.toml");
  await renewed(page, () => dropped(page, { "my.toml": silent.replace('"register 3700 = 4"', '"register 3700 = 0"') }));
  await shows(page, "#message.bad", /^FAILED my\.toml\nmy\.toml:\d+: expected register 3700 = 0: it is 4\n[^]*the last frames/);
  await shows(page, "#event-list", /read node/);
  await dropped(page, { "my.toml": silent.replace("do =", "doo =") });
  await shows(page, "#message.bad", /my\.toml:\d+: step\.doo: no such key; did you mean do\?/);
  await shows(page, "#event-list", /read node/);
  assert.equal(await text(page, "#live"), "live");
});

look("a shipped scenario as a file", async (page) => {
  await renewed(page, () => dropped(page, { "tank_level.toml": read("scenarios/tank_level.toml") }));
  await shows(page, "#message.good", /^passed tank_level\.toml/);
});

look("an EDS file becomes a node, which a colleague sees too", async (page, plant) => {
  await renewed(page, () => dropped(page, { "io_module.eds": read("plants/demo/io_module.eds") }));
  assert.deepEqual((await nodes(plant)).map(parseFloat), [66, 1, 2, 16, 32, 3]);
  await shows(page, "#message", /^io_module\.eds is node 3\./);
  const valve = read("plants/demo/generic.eds").replace("DataType=0x0007", "DataType=0x9999");
  await renewed(page, () => dropped(page, { "valve.dcf": valve, "x.EDS": read("plants/demo/generic.eds") }));
  assert.deepEqual((await nodes(plant)).map(parseFloat), [66, 1, 2, 16, 32, 3, 4, 5]);
  await shows(page, "#message", /plants\/demo\/4\/valve\.dcf:\d+: DataType 9999h is unknown[^]*\nx\.EDS is node 5\./);
  const context = await browser.createBrowserContext(), other = tabPlant(page.url());
  const colleague = await open(context, other);
  assert.deepEqual(await nodes(other), await nodes(plant));
  await send(colleague, "trigger read 3 0x1000 0 4");
  await shows(colleague, "#verdict", /read node 3 1000h:00.*done/);
  assert.match(await page.$eval("#chooser", ({ selectedOptions: [{ text }] }) => text), /plant\.toml/);
  console.log(`figure: the address has ${page.url().length} characters`);
  await context.close();
});

look("an EDS file with mistakes leaves the plant as it is", async (page, plant) => {
  await send(page, "write 3701 4711");
  const before = (await plant.about()).time, url = page.url();
  await dropped(page, { "broken.eds": "[FileInfo]\n" });
  await shows(page, "#message.bad", /^plants\/demo\/3\/broken\.eds:1: there is no object in it/);
  assert.equal(await plant.control("read 3701"), "ok 4711\n");
  assert.ok((await plant.about()).time > before);
  assert.equal(page.url(), url);
  await click(page, "#message button", "Close");
  assert.equal(await page.$eval("#message", ({ hidden }) => hidden), true);
  await dropped(page, { "picture.png": "x" });
  await shows(page, "#message.bad", /^picture\.png: choose EDS or DCF files/);
  assert.deepEqual(await nodes(plant), demo);
});

look("a plant file with its files", async (page, plant) => {
  const objects = { 1000: 7, 1001: 5, 2000: 8, 2001: 5, 2002: 5, 2003: 5 };
  const sections = Object.entries(objects).map(([index, type]) => `[${index}]\nParameterName=F\xfcllstand\nDataType=${type}\n`);
  const eds = Buffer.from(`[FileInfo]\n${sections.join("")}`, "latin1");
  const file = '[module]\nnode_id = 1\n[[node]]\nid = 20\nname = "Tank"\neds = "../devices/tank.eds"\ndevice = "tank.lua"\n';
  await renewed(page, () => dropped(page, { "tank.eds": eds, "my.toml": file, "tank.lua": read("plants/tank.lua") }));
  assert.deepEqual(await nodes(plant), ["20 Tank"]);
  await send(page, "incident 20 leak on");
  await send(page, "trigger read 20 0x2000 0 4");
  await shows(page, "#verdict", /2000h:00 Füllstand.*done/);
  await page.evaluate(() => { document.querySelector("#files").click = () => {}; });
  await renewed(page, async () => (await page.$("#files")).uploadFile(join(source, "plants/demo/generic.eds")));
  assert.deepEqual((await nodes(plant)).map(parseFloat), [20, 2]);
  await dropped(page, { "my.toml": file });
  await shows(page, "#message.bad", /^my\.toml:\d+: node 20: cannot read \.\.\/devices\/tank\.eds/);
});

const good = addressOf({ main: "a.toml", files: { "a.toml": '[[node]]\nid = 7\nname = "Mine"\neds = "plants/demo/generic.eds"\n' } });
for (const [name, address, words] of [
  ["names nothing", "#plants/nowhere.toml", /^The address names no plant, or is incomplete\.\nThis is the demo plant\./],
  ["names what every object has", "#toString", /^The address names no plant/],
  ["is cut", good.slice(0, -4), /^The address names no plant/],
  ["has something else", addressOf({ main: "a.toml", files: { "a.toml": 3 } }), /^The address names no plant/],
  ["has a plant file with a mistake", addressOf({ main: "a.toml", files: { "a.toml": "[[node]]\nid = 300\n" } }),
    /a\.toml:2: node\.id 300: must be 1\.\.127\n[^]*This is the demo plant\./],
  ["names a file of another site", addressOf({ main: "http://localhost/plants/a.toml", files: {} }), /cannot be[^]*This is the demo plant\./],
])
  look(`an address that ${name}`, async (page, plant) => {
    await shows(page, "#message.bad", words);
    assert.deepEqual(await nodes(plant), demo);
    assert.equal(await page.evaluate(() => location.hash), "#demo");
    assert.equal(await page.$eval("#chooser", ({ value }) => value), "demo");
    await renewed(page, () => page.evaluate((hash) => { location.hash = hash; }, good));
    assert.deepEqual(await nodes(plant), ["7 Mine"]);
  }, { address });

look("a crash, and a new instance", async (page, plant) => {
  await send(page, "write 3701 4711");
  await page.workers()[0].evaluate(async () => {
    const { Instance } = await import("./instance.js");
    Instance.prototype.pass = function () { this.receive(99, new Uint8Array(1)); };
  });
  await shows(page, "#message.bad", /^the plant has crashed and cannot go on: /);
  await shows(page, "#live", /no simulator/);
  await send(page, "time", /^error: the plant has crashed/);
  await renewed(page, () => click(page, "#message button", "Restart"));
  assert.equal(await plant.control("read 3701"), "ok 0\n");
});

look("the end, by a command", async (page) => {
  await send(page, "shutdown", /./);
  await shows(page, "#message.bad", /^The plant has been shut down\./);
});

look("after a sleep the plant goes on where it was", async (page, plant) => {
  const sleep = (seconds) => page.workers()[0].evaluate((milliseconds) => {
    const now = performance.now.bind(performance);
    performance.now = () => now() + milliseconds;
  }, seconds * 1000);
  const before = (await plant.about()).time;
  await sleep(8);
  const then = (await plant.about()).time;
  assert.ok(then > before + 8, `${before} -> ${then}`);
  await sleep(3600);
  assert.ok((await plant.about()).time < then + 30);
});

const untyped = await serveFolder(tab, "text/plain"), incomplete = await serveFolder(tab, "");
look("a server that knows no type for the module", (page) => send(page, "time"), { url: untyped });

test("a module that is missing", async () => {
  count();
  const page = await browser.newPage();
  await page.goto(incomplete);
  await shows(page, "#message", /cbcan\.wasm: 404/);
  await page.close();
});
