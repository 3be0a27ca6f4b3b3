// SPDX-License-Identifier: MIT
// The page in a browser, and its effect on a plant: of cbcan-sim, or in the tab.
// usage: node page_test.mjs CBCAN_SIM SOURCE_FOLDER SCREENSHOT_FOLDER [TAB_FOLDER]
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import test from "node:test";
import { NARROW, WIDE, addressOf, click, drive, looker, serveFolder, shows, startPlant, tabPlant } from "./browser.mjs";
import { count } from "./cases.mjs";
import { outside, pale, scrolled } from "./inspect.mjs";

const [program, source, shots, tab] = process.argv.slice(2);
const EXECUTE = 0xca0e, READ = 5055;
const { look: lookAt } = await looker(shots);
const site = tab && await serveFolder(tab);

/// The demo plant with these options.
function start(options) {
  if (!tab) return startPlant(program, options);
  const main = "plants/demo/plant.toml", tables = { "--network": "[[network]]", "--clock": '[time]\nclock = "manual"' };
  const text = [readFileSync(`${source}/${main}`, "utf8"), ...options.map((option) => tables[option])].join("\n");
  return tabPlant(site + (options.length > 0 ? addressOf({ main, files: { [main]: text } }) : ""));
}

/// `served`: it needs a server, which also takes other clients. `inLong`: for tools/test --long.
function look(name, use, { options = [], served = false, inLong = false, ...view } = {}) {
  if (!(tab && served) && !(inLong && !process.env.CBCAN_LONG)) lookAt(name, () => start(options), use, view);
}
const manual = { options: ["--clock", "manual"] };

/// The PLC reads the device type of node 32, whose response is suppressed, and polls until it has the result.
async function failing(plant) {
  const plc = await plant.plc();
  await plant.control("fault 32 response-never count=1");
  await plc.request(16, 3700, EXECUTE, READ, 32, 0x1000, 0, 4);
  for (let poll = 0; poll < 5; ++poll) {
    await plc.request(3, 3700, 1);
    await plant.control("pass 10ms");
  }
  await plant.control("pass 1s");
  assert.deepEqual(await plc.request(3, 3700, 1), [4]);
  plc.close();
}

test("what is not ours is as it was published", () => {
  count();
  const folder = `${source}/hostsim/web/page`;
  for (const line of readFileSync(`${folder}/uPlot.sha256`, "utf8").trim().split("\n")) {
    const [sum, name] = line.split(/\s+/);
    assert.equal(createHash("sha256").update(readFileSync(`${folder}/${name}`)).digest("hex"), sum, name);
  }
});

look("files have types and a strict policy", async (page, plant) => {
  for (const name of ["", ...readdirSync(`${source}/hostsim/web/page`)]) {
    const response = await fetch(`${plant.url}/${name}`);
    assert.equal(response.status, 200, name);
    assert.match(response.headers.get("content-security-policy"), /^default-src 'self'/);
    assert.match(response.headers.get("cache-control"), /no-(cache|store)/);
    const type = { html: "text/html", "": "text/html", css: "text/css", js: "text/javascript", svg: "image/svg" }[name.split(".").pop()] ?? "text/plain";
    assert.ok(response.headers.get("content-type").startsWith(type), name);
  }
  assert.equal((await fetch(`${plant.url}/nothing.js`)).status, 404);
}, { served: true });

look("the ladder tells why a transaction failed", async (page, plant) => {
  await failing(plant);
  await shows(page, "#verdict", /#1 +read node 32 1000h:00.*0504 0000h.*1,0\d\d ms/);
  for (const words of [...tab ? [/read node 32 1000h:00/] : [/execute: read 1000h:00/, /busy × 5/, /reads/],
    /R3700 CA0EhR3701 5055R3702 32R3703 1000hR3704 0/, /R3700 4R3706 0000hR3707 0504h/, /read 1000h:00/, /fault 1: response-never count=1 swallowed this/,
    /1,000 msSDO time-out/, /R3700 = 4 · 0504 0000h/]) await shows(page, "#diagram", words);
  assert.equal(await page.$eval("#diagram .fault path", (path) => getComputedStyle(path).strokeDasharray), "5px, 4px");
  await plant.control("trigger read 32 0x1000 0 4", "pass 2s");
  await shows(page, "#diagram", /msheld back: quarantine/);
  await shows(page, "#diagram", /R3700 = 0 · done/);
}, manual);

writeFileSync(`${shots}/failure.toml`, 'plant = "demo"\n\n[explore]\nonly = ["32:response-never@2"]\n');
look("the ladder shows the moment of a failure that --explore has found", async (page, plant) => {
  await plant.control("trigger read 32 0x1000 0 4", "pass 1s", "trigger read 32 0x1000 0 4", "pass 2s");
  await shows(page, "#verdict", /#2 +read node 32 1000h:00.*0504 0000h/);
  await shows(page, "#diagram", /fault 1: response-never after=1 count=1 swallowed this/);
}, { options: ["--clock", "manual", "--config", `${shots}/failure.toml`], served: true });

look("the ladder shows the PLC's read of the result, however late", async (page, plant) => {
  const plc = await plant.plc();
  await plc.request(16, 3700, EXECUTE, READ, 32, 0x1000, 0, 4);
  await plant.control("pass 1s");
  await shows(page, "#diagram", /R3700 = 0 · done/);
  await plc.request(3, 3700, 1);
  await shows(page, "#diagram", /reads/);
  plc.close();
}, { ...manual, served: true });

/// Established TCP connections to this port of the machine.
const connectionsTo = (port) => readFileSync("/proc/net/tcp", "utf8").split("\n").slice(1).map((line) => line.trim().split(/\s+/))
  .filter(([, local, , state]) => parseInt(local?.split(":")[1], 16) === port && state === "01").length;

look("a page that follows a busy PLC asks nothing, and needs two connections", async (page, plant) => {
  const asked = [];
  await page.waitForFunction(() => document.querySelectorAll("#node-panel .points > *").length);
  page.on("request", (request) => { if (!request.url().endsWith("/points?network=1")) asked.push(request.url()); });
  const plc = await plant.plc();
  for (let number = 0; number < 200; ++number) {
    await plc.request(16, 3700, EXECUTE, READ, 32, 0x1000, 0, 4);
    assert.deepEqual(await plc.request(3, 3700, 1), [0]);
  }
  plc.close();
  await shows(page, "#verdict", /#200 +read node 32/);
  for (const words of [/execute: read 1000h:00/, /R3700 = 0 · done/, /reads/]) await shows(page, "#diagram", words);
  assert.deepEqual(asked, []);
  assert.ok(connectionsTo(Number(new URL(plant.url).port)) <= 2);
}, { served: true });

look("transactions are filtered", async (page, plant) => {
  await failing(plant);
  await plant.control("trigger read 66 0x1000 0 4", "pass 1ms", "trigger write 66 0x6411 1 2 300", "pass 1ms");
  await page.waitForFunction(() => document.querySelectorAll("#event-list .row").length === 3);
  const rows = async (pattern) => { await shows(page, "#event-list", pattern); return page.$$eval("#event-list .row", (all) => all.length); };
  await click(page, ".switch input, .switch", "failed");
  assert.equal(await rows(/^\d\.\d{3}#1 *read node 32.{1,60}0504 0000h · 1,0\d\d ms$/), 1);
  await click(page, ".switch", "failed");
  await page.select("#filter-service", "write");
  assert.equal(await rows(/^\d\.\d{3}#3 *write node 66 6411h.{1,60}$/), 1);
  await page.select("#filter-service", "");
  await page.type("#filter-text", "1000h:00 device");
  assert.equal(await rows(/^\d\.\d{3}#2.*#1.{1,90}$/), 2);
  await page.select("#filter-node", "66");
  assert.equal(await rows(/^\d\.\d{3}#2.{1,60}$/), 1);
  await click(page, "#event-view button", "Everything");
  assert.ok(await rows(/SDO node 66/) >= 2);
}, manual);

look("registers are named, lit and written", async (page, plant) => {
  await click(page, "#ladder button", "Registers");
  await click(page, "#register-list .row", "OBJECT_INDEX");
  await page.keyboard.type("0x1008\n");
  await shows(page, "#register-list .lit", /R3703 *4104 *1008h/);
  assert.equal(await page.$eval("#command", (field) => field.value), "write 3703 0x1008");
  await shows(page, "#answer", /^ok$/);
  assert.equal(await plant.control("read 3703"), "ok 4104\n");
  for (const name of [/43704/, /403704/, /R3703/]) {
    await click(page, "#notation", "");
    await shows(page, "#register-list", name);
  }
  await click(page, "#register-view button", "Scanner");
  await shows(page, "#register-list", /R500.*OUT_NUMBER/);
  await click(page, "#register-view button", "Process");
  await shows(page, "#register-list", /R3800.*IN 0/);
  await click(page, "#register-view button", "Network");
  await shows(page, "#register-list", /R3928.*STATUS.*R3932 *6 *0006h *HEARD *nodes 1\.\.2R3933 *1 *0001h *HEARD *node 16/);
});

look("process data says what it is exchanged with", async (page, plant) => {
  const write = (object, size, value) => [`trigger write 0 ${object} ${size} ${value & 0xffff}${size === 4 ? ` ${value >>> 16}` : ""}`, "pass 1ms"];
  await plant.control(...write("0x1600 1", 4, 0xa0c00110), ...write("0x1600 2", 4, 0xa0c00210), ...write("0x1600 0", 1, 2),
    ...write("0x1400 1", 4, 0x2c2), ...write("0x1A00 1", 4, 0xa5400110), ...write("0x1A00 0", 1, 1), ...write("0x1800 1", 4, 0x342));
  await click(page, "#ladder button", "Registers");
  await click(page, "#register-view button", "Process");
  await shows(page, "#register-list", /R3800.*IN 066 6401h:01 Channel 1.*R3801.*66 6401h:02/);
  await page.focus("#register-list");
  await page.keyboard.press("End");
  await page.$eval("#register-list", (list) => { list.scrollTop = 22 * 60; });
  await shows(page, "#register-list", /R3864.*OUT 066 6411h:01/);
}, manual);

look("what a click does is a command", async (page, plant) => {
  const does = async (line, answer = /^ok/) => {
    await page.waitForFunction((wanted) => document.querySelector("#command").value === wanted, {}, line);
    await shows(page, "#answer", answer);
  };
  await click(page, "#plant button", "Start all");
  await does("nmt start all");
  await shows(page, "#node-list", /Drive *operational/);
  await click(page, "#node-list .tile", "Drive");
  await click(page, "#node-panel .switch", "overtemperature");
  await does("incident 16 overtemperature on");
  await shows(page, "#node-list", /Drive *operational *EMCY 4210h device temperature *overtemperature.*fault/);
  await plant.control("incident 16 warning on");
  await page.waitForFunction(() => [...document.querySelectorAll("#node-panel .switch")].find((label) => label.textContent === "warning").firstChild.checked);
  await page.$eval("#command", (field) => { field.value = ""; });
  await page.type("#node-panel .fault-form input", "delay_ms=20");
  await click(page, "#node-panel button", "Inject");
  assert.equal(await page.evaluate(() => document.activeElement.ariaLabel), "Kind of fault");
  assert.deepEqual([await page.$eval("#command", (field) => field.value), await plant.control("faults")], ["", "ok\n"]);
  await page.select("#node-panel .fault-form select", "response-late");
  await shows(page, "#node-panel .fault-form", /An SDO response is sent late/);
  await click(page, "#node-panel button", "Inject");
  await does("fault 16 response-late delay_ms=20", /^ok 1$/);
  await click(page, "#faults .switch", "response-late");
  await does("clear 16 1");
  await click(page, "#node-list .tile", "I/O module");
  await page.waitForSelector("#node-panel input[type=range][aria-label='analogue input 1']");
  await page.$eval("#node-panel input[type=range][aria-label='analogue input 1']", (slider) => {
    slider.value = 1000;
    slider.dispatchEvent(new Event("change"));
  });
  await does("set 66 0x6401:1 1000");
  await plant.control("set 66 0x6401:1 -7");  // by another client
  await page.waitForFunction(() => [...document.querySelectorAll("#node-panel .points input[aria-label^='analogue input 1']")].every((input) => input.value === "-7"));
  await click(page, "#node-panel .points .switch", "3");
  await does("set 66 0x6000:1.2 1");
  await plant.control("trigger write 66 0x6200 1 1 5");
  await page.waitForSelector("#node-panel .lamp.on[aria-label='outputs 1 to 8: 3 on']");
  assert.equal((await page.$$("#node-panel .lamp.on")).length, 2);
  await click(page, "#node-panel .switch", "power");
  await does("power 66 off");
  await shows(page, "#node-list", /I\/O module *off/);
  await click(page, "#node-list .tile", "Generic node");
  await click(page, "#node-view button", "Dictionary");
  await page.type("#node-panel input[type=search]", "2080");
  await click(page, "#node-panel .row", "2080h:00");
  assert.ok(await page.$$eval("#node-panel .list .row", (rows) => rows.length) < 9);
  assert.match(await plant.control("get 66 0x6401:1"), /^error/);
});

look("one cursor goes through plots, transactions and frames", async (page, plant) => {
  await shows(page, "#legend", /position demand/);
  await drive(plant);
  await page.waitForFunction(() => document.querySelectorAll("#legend b")[1].textContent === "60000");
  const { x, y, width, height } = await (await page.$("#plot .u-over")).boundingBox();
  await page.mouse.move(x + width * 0.4, y + height / 2);
  await page.mouse.move(x + width * 0.41, y + height / 2);
  const moving = await page.waitForFunction(() => Number(document.querySelectorAll("#legend b")[1].textContent) < 60000);
  assert.ok(moving);
  await page.mouse.move(5, 5);
  await click(page, "#event-list .row", "6040h:00 Controlword = 001Fh");
  await page.waitForSelector("#event-list .row.near");
  await page.waitForSelector("#diagram g.near");
  for (const chart of ["plot", "lanes"])
    await page.waitForFunction((id) => /translate\([1-9]/.test(document.querySelector(`#${id} .u-cursor-x`).style.transform), {}, chart);
}, manual);

look("any object is plotted", async (page, plant) => {
  await click(page, "#node-list .tile", "Pressure transducer 1");
  await shows(page, "#legend", /process value 1 *99021 *Pa/);
  assert.match(await plant.control("set 1 0x9130:1 123456"), /^ok/);
  await shows(page, "#legend", /123456/);
  await click(page, "#node-view button", "Dictionary");
  await page.type("#node-panel input[type=search]", "1000");
  await click(page, "#node-panel .row", "1000h:00");
  await click(page, "#node-panel button", "Plot");
  await shows(page, "#legend", /Device type *131476/);
});

look("time passes by clicks", async (page) => {
  await shows(page, "#facts", /00:00:00\.000/);
  await click(page, "#manual button", "Pass 100 ms");
  await shows(page, "#facts", /00:00:00\.100/);
  await click(page, "#manual button", "Step 1 ms");
  await shows(page, "#facts", /00:00:00\.101/);
  await shows(page, "#answer", /^at 0\.101000$/);
}, manual);

look("what is saved is a scenario that passes", async (page, plant) => {
  await failing(plant);
  await plant.control("incident 16 overcurrent on", "pass 61s", "trigger read 66 0x1000 0 4", "pass 10ms", "nmt start 66");
  await failing(plant);
  await page.waitForFunction(() => document.querySelectorAll("#event-list .row").length === 3);
  const saved = await page.evaluate(async () => (await import("./scenario.js")).saveScenario());
  assert.match(saved, /plant = "(?:demo|.*plant\.toml)"[^]*"incident 16 overcurrent on"[^]*do = "trigger read 66 0x1000 0 4"[^]*do = "write 3700 51726 5055 32 4096 0 4"/);
  writeFileSync(`${shots}/saved.toml`, saved.replace("./plants/demo/plant.toml", "demo"));
  assert.match(execFileSync(program, ["run", `${shots}/saved.toml`], { encoding: "utf8" }), /1 passed/);
}, manual);

for (const [size, width] of [[WIDE, 1280], [NARROW, 390]])
  for (const scheme of ["light", "dark"])
    look(`nothing is cut or pale at ${width} in ${scheme}`, async (page, plant) => {
      await shows(page, "#legend", /position demand/);
      await drive(plant);
      await failing(plant);
      await shows(page, "#verdict", /0504 0000h/);
      const views = [["Control", "I/O module"], ["Dictionary", "Drive"], ["Control", "Drive"]];
      for (const [view, key] of scheme === "dark" ? views.reverse() : views) {
        await click(page, "#node-list .tile", key);
        await click(page, "#node-view button", view);
        await page.waitForSelector(view === "Control" ? "#node-panel .fault-form" : "#node-panel .row");
        if (size === WIDE && view === "Control") assert.deepEqual(await page.evaluate(scrolled), []);
        assert.deepEqual(await page.evaluate(outside), []);
        assert.deepEqual(await page.evaluate(pale), []);
      }
      if (scheme === "dark") for (const level of [400, 900, 700]) {
        await plant.control(`set 66 0x6401:1 ${level}`, "pass 500ms");
        await page.waitForFunction((value) => document.querySelector("#node-panel .points input.number").value === value, {}, String(level));
      }
      await page.$eval("#answer", (output) => { output.textContent = "ok"; });
    }, { ...manual, size, scheme, inLong: scheme === "dark" });

look("the keyboard is enough", async (page, plant) => {
  await plant.control("trigger read 66 0x1000 0 4", "trigger read 16 0x1000 0 4");
  await page.waitForFunction(() => document.querySelectorAll("#event-list .row").length === 2);
  if (tab) await shows(page, "#counts", /4 operational/);  // its network file does not start node 32, which is first then
  const nodes = tab ? [32, 66, 1, 2, 16] : [66, 1, 2, 16, 32], reached = new Set();
  for (let times = 0; times < 120; ++times) {
    await page.keyboard.press("Tab");
    const [id, outline] = await page.evaluate(() => [document.activeElement.id || (document.activeElement === document.body ? '' : document.activeElement.textContent), getComputedStyle(document.activeElement).outlineStyle]);
    if (reached.has(id) && id === "save") break;
    reached.add(id);
    if (id !== "") assert.notEqual(outline, "none", id);
    if (id === "node-list") {
      for (const [key, at] of [["Home", 0], ["ArrowRight", 1], ["ArrowDown", 4], ["ArrowUp", 1], ["End", 4]]) {
        await page.keyboard.press(key);
        await shows(page, "#node-title", new RegExp(`^${nodes[at]} `));
      }
    }
    if (id === "event-list") {
      await page.keyboard.press("ArrowDown");
      await page.keyboard.press("ArrowDown");
      await shows(page, "#verdict", /#1 /);
    }
  }
  for (const id of ["save", "more-registers", "diagram", "event-list", "filter-text", "node-list", "span", "hold", "command", "copy"])
    assert.ok(reached.has(id), `${id} cannot be reached: ${[...reached]}`);
  await click(page, "#ladder button", "Registers");
  await page.focus("#register-list");
  for (const key of ["Home", "ArrowDown", "Enter"]) await page.keyboard.press(key);
  assert.equal(await page.evaluate(() => document.activeElement.id), "register-value");
  await page.keyboard.type("7\n");
  await shows(page, "#answer", /^ok/);
  await page.keyboard.press("Escape");
  assert.equal(await page.evaluate(() => document.activeElement.id), "register-list");
  assert.equal(await plant.control("read 3701"), "ok 7\n");
});

look("10,000 events a second do not freeze it", async (page, plant) => {
  await click(page, "#event-view button", "Everything");
  await page.evaluate(() => {
    window.longest = 0;
    let last = performance.now();
    (function frame(now) { window.longest = Math.max(window.longest, now - last); last = now; requestAnimationFrame(frame); })(last);
  });
  await plant.control("fault bus bus-load frames_per_s=10000 percent=100");
  const { next_event: first } = await plant.about();
  for (let tenth = 0; tenth < 25; ++tenth) {
    if (tenth === 10) await click(page, "#plant button", "Start all");
    await plant.control("pass 100ms");
    await page.evaluate(() => new Promise(requestAnimationFrame));
  }
  await shows(page, "#event-list", /frame/);
  await shows(page, "#answer", /^ok/);
  await page.waitForFunction((begin) => document.querySelector("#event-list .row").item.number > begin + 20000, {}, first);
  const { rows, elements, longest } = await page.evaluate(async () => ({ rows: (await import("./state.js")).state.recent.length,
    elements: document.querySelectorAll("*").length, longest: window.longest }));
  assert.ok(rows <= 2200 && elements < 1500, `${rows} events kept, ${elements} elements`);
  console.log(`the longest picture at 10,000 events a second: ${Math.round(longest)} ms`);
}, { ...manual, inLong: true });

look("it comes back after a restart", async (page, plant) => {
  await plant.control("trigger read 66 0x1000 0 4", "trigger read 66 0x1000 0 4");
  await shows(page, "#event-list", /#2/);
  await plant.stop();
  await shows(page, "#live", /no simulator/);
  const again = await startPlant(program, [], plant.where.http);
  await shows(page, "#live", /live/);
  await again.control("trigger write 66 0x6411 1 2 300");
  await shows(page, "#event-list", /^\d+\.\d{3}#1 *write node 66.{1,60}$/);
  await again.stop();
}, { served: true });

look("another network is chosen", async (page, plant) => {
  await plant.control("trigger 2/read 5 0x1000 0 4", "trigger read 32 0x1000 0 4");
  await shows(page, "#event-list", /^\d+\.\d{3}#\d *read node 32.{1,60}$/);
  await page.select("#network", "2");
  await shows(page, "#verdict", /read node 5 .*0504 0000h/);
  await click(page, "#plant button", "Start all");
  await page.waitForFunction(() => document.querySelector("#command").value === "nmt start 2/all");
  await page.select("#network", "1");
  await shows(page, "#verdict", /read node 32/);
  await shows(page, "#legend", /position demand/);
}, { options: ["--network", "2"] });

look("nodes of the network before are not shown in the one that has been chosen", async (page, plant) => {
  await page.evaluate(async () => {
    const { server } = await import("./server.js"), { request } = server, { parse } = JSON;
    server.request = async (path, ...more) => {
      if (path === "api/nodes?network=2") await new Promise((done) => { window.release = done; });
      return request(path, ...more);
    };
    JSON.parse = (text) => { const message = parse(text); if (message?.kind === "now") (window.seen ??= []).push(message.network); return message; };
  });
  await page.select("#network", "2");
  await page.waitForFunction(() => window.release);
  await page.evaluate(() => { window.seen = []; });
  await plant.control("nmt start all");
  await page.waitForFunction(() => window.seen.includes(1));
  assert.deepEqual(await page.evaluate(async () => (await import("./state.js")).state.nodes), []);
  await page.evaluate(() => window.release());
  await plant.control("trigger 2/read 5 0x1000 0 4");
  await shows(page, "#verdict", /read node 5 .*0504 0000h/);
}, { options: ["--network", "2"] });

look("a transaction that ends while a network is being chosen is in its list", async (page, plant) => {
  await plant.control("trigger 2/read 5 0x1000 0 4", "pass 1ms");
  await page.evaluate(async () => {
    const { server } = await import("./server.js"), { request, follow } = server;
    server.request = async (path, ...more) => {
      if (path === "api/journal?network=2") await new Promise((done) => { window.release = done; });
      const response = await request(path, ...more);
      if (path === "api/transactions?network=2") window.answered = true;
      return response;
    };
    server.follow = (path) => { window.followed = true; return follow(path); };
  });
  await page.select("#network", "2");
  await page.waitForFunction(() => window.release && window.answered);
  await plant.control("pass 2s");
  await page.evaluate(() => { window.followed = false; window.release(); });
  await page.waitForFunction(() => window.followed);
  await shows(page, "#event-list", /^\d+\.\d{3}#\d *read node 5.{1,60}$/);
  assert.equal(await page.evaluate(async () => (await import("./state.js")).state.ended.length), 1);
}, { options: ["--network", "2", "--clock", "manual"] });

look("events of before a network was chosen do not clear its list", async (page, plant) => {
  await plant.control("trigger 2/read 5 0x1000 0 4", "pass 2s", "trigger read 32 0x1000 0 4", "pass 1ms");
  await shows(page, "#event-list", /read node 32/);
  const polled = { polling: 20 };  // not by animation frames, which are held here
  await page.evaluate(() => {
    const atOnce = window.requestAnimationFrame, held = [];
    window.requestAnimationFrame = (call) => held.push(call);
    Object.assign(window, { held, release: () => { window.requestAnimationFrame = atOnce; held.forEach((call) => atOnce(call)); } });
  });
  await plant.control("trigger 2/read 5 0x1000 0 4", "pass 2s");
  await page.waitForFunction(() => window.held.length > 0, polled);
  await page.select("#network", "2");
  await page.waitForFunction(async () => (await import("./state.js")).state.ended.length === 2, polled);
  await page.evaluate(() => { window.release(); return new Promise((done) => requestAnimationFrame(() => setTimeout(done))); });
  assert.equal(await page.evaluate(async () => (await import("./state.js")).state.ended.length), 2);
}, { options: ["--network", "2", "--clock", "manual"] });

look("a day leaves no more than an hour did", async (page, plant) => {
  await plant.control("nmt start all", "trigger write 66 0x1017 0 2 500", "pass 1ms", "trigger write 16 0x1017 0 2 500", "pass 1ms");
  const heap = async (hours) => {
    for (let hour = 0; hour < hours; ++hour)
      await plant.control("trigger read 66 0x1000 0 4", "set 66 0x6401:1 " + hour, "pass 3600s");
    const { time } = await plant.about();
    await page.waitForFunction(async (wanted) => (await import("./state.js")).state.about.time >= wanted, {}, time);
    await page.waitForFunction(async () => (await import("./state.js")).state.recent.length >= 2000);
    const session = await page.createCDPSession();
    await session.send("HeapProfiler.collectGarbage");
    return (await session.send("Runtime.getHeapUsage")).usedSize / 1e6;
  };
  const hour = await heap(1), day = await heap(23);
  console.log(`heap after an hour ${hour.toFixed(1)} MB, after a day ${day.toFixed(1)} MB`);
  assert.ok(day < hour + 8, `${hour} -> ${day} MB`);
}, { ...manual, inLong: true });
