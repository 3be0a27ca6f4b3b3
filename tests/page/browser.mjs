// SPDX-License-Identifier: MIT
// A browser on the page of a running cbcan-sim or on the folder of the tab, and a short Modbus client.
import assert from "node:assert/strict";
import { once } from "node:events";
import { mkdirSync, readFileSync } from "node:fs";
import { createServer } from "node:http";
import { connect } from "node:net";
import { join } from "node:path";
import test, { after } from "node:test";
import { deflateRawSync } from "node:zlib";
import puppeteer from "puppeteer-core";
import { LIMIT, count, startSimulator } from "./cases.mjs";

export const WIDE = { width: 1280, height: 800 }, NARROW = { width: 390, height: 844 };

export const launch = () => puppeteer.launch({ executablePath: "/usr/bin/chromium", protocolTimeout: LIMIT,
  args: ["--no-sandbox", "--disable-gpu", "--force-color-profile=srgb"] });

/// cbcan-sim with its page; `control` sends commands and returns the responses.
export async function startPlant(program, options = [], http = "127.0.0.1:0") {
  const demo = options.includes("--config") ? [] : ["--demo"];
  const simulator = await startSimulator(program, ...demo, "--modbus", "127.0.0.1:0", "--http", http, ...options);
  const url = `http://${simulator.where.http}`;
  const control = async (...lines) => (await fetch(`${url}/api/control`, { method: "POST", body: lines.join("\n") })).text();
  const about = async () => (await fetch(`${url}/api/time`)).json();
  return { ...simulator, url, control, about, plc: () => modbusClient(simulator.where.modbus) };
}

// ---- The tab

/// A web server with this folder at /some/where/. `wasm`: the type of the module; none = it has no such file.
export async function serveFolder(folder, wasm = "application/wasm") {
  const types = { html: "text/html", js: "text/javascript", css: "text/css", svg: "image/svg+xml", wasm };
  const server = createServer(({ url }, response) => {
    const name = new URL(url, "http://localhost").pathname.replace(/^\/some\/where\//, "") || "index.html";
    try {
      if (!types[name.split(".").pop()] && name.endsWith("wasm")) throw new Error("not there");
      const content = readFileSync(join(folder, name));
      response.writeHead(200, { "Content-Type": types[name.split(".").pop()] ?? "text/plain" }).end(content);
    } catch {
      response.writeHead(404).end("not found");
    }
  });
  await once(server.listen(0, "127.0.0.1"), "listening");
  server.unref();
  return `http://127.0.0.1:${server.address().port}/some/where/`;
}

export const addressOf = (plant) => `#plant=${deflateRawSync(JSON.stringify(plant)).toString("base64url")}`;

/// A plant that runs in the page once open() has opened it.
export function tabPlant(url) {
  const ask = (path, options) => plant.page.evaluate(async (...given) => (await (await import("./server.js")).server.request(...given)).text(), path, options);
  const control = (...lines) => ask("api/control", { method: "POST", body: lines.join("\n") });
  const write = (first, words) => control(`write ${first} ${words.join(" ")}`);
  const read = async (first, count) => (await control(`read ${first} ${count}`)).trim().split(" ").slice(1).map(Number);
  const plc = () => ({ request: (code, first, ...words) => (code === 16 ? write(first, words) : read(first, words[0])), close: () => {} });
  const plant = { url, ask, control, plc, about: async () => JSON.parse(await ask("api/time")), stop: () => {} };
  return plant;
}

/// The page, once it is live; `errors` has its errors, and each request to another site.
export async function open(browser, plant, { size = WIDE, scheme = "light" } = {}) {
  const page = plant.page = await browser.newPage();
  page.setDefaultTimeout(LIMIT);
  page.errors = [];
  page.on("pageerror", (error) => page.errors.push(String(error.stack)));
  page.on("console", (message) => { if (message.text().includes("Security Policy")) page.errors.push(message.text()); });
  page.on("request", (request) => { if (!/^(blob:)?http:\/\/127/.test(request.url())) page.errors.push(`asks ${request.url()}`); });
  await page.setViewport(size);
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }, { name: "prefers-reduced-motion", value: "reduce" }]);
  await page.goto(plant.url);
  await page.waitForFunction(() => document.querySelector("#live").textContent === "live");
  await page.waitForSelector("#node-list .tile");
  return page;
}

/// { browser, look }: look(name, start, use, options) is a case that opens the page of the plant that start() makes, in the view of the
/// options. `meant`: errors of the page that it causes. A screenshot stays in `folder`.
export async function looker(folder) {
  mkdirSync(folder, { recursive: true });
  const browser = await launch();
  after(() => browser.close());
  const look = (name, start, use, { meant = [], ...view } = {}) => test(name, async () => {
    count();
    const plant = await start();
    let page;
    try {
      page = await open(browser, plant, view);
      await use(page, plant);
      assert.deepEqual(page.errors.filter((error) => !meant.some((pattern) => pattern.test(error))), []);
    } finally {
      await page?.screenshot({ path: `${folder}/${name.replace(/\W+/g, "-")}.png` });
      await page?.close();
      await plant.stop();
    }
  });
  return { browser, look };
}

export const text = (page, selector) => page.$eval(selector, (element) => element.textContent);

/// Waits until the text of `selector` matches.
export const shows = (page, selector, pattern) => page.waitForFunction(
  (where, source) => new RegExp(source).test(document.querySelector(where)?.textContent), {}, selector, pattern.source);

/// Clicks the element with this selector and text: a button, a row, a label.
export async function click(page, selector, words) {
  const found = await page.waitForFunction((where, wanted) => [...document.querySelectorAll(where)]
    .find((element) => element.textContent.includes(wanted) && element.offsetParent), {}, selector, words);
  await found.asElement().evaluate((element) => element.click());
}

/// Makes a drive move, for the plots.
export async function drive(plant) {
  const write = (object, size, value) => `trigger write 16 ${object} ${size} ${value & 0xffff}${size === 4 ? ` ${value >> 16}` : ""}`;
  await plant.control("nmt start all", "pass 50ms", "set 66 0x6401:1 1250", ...[128, 6, 7, 15].flatMap((word) => [write("0x6040 0", 2, word), "pass 20ms"]),
    write("0x6060 0", 1, 1), write("0x6081 0", 4, 20000), write("0x6083 0", 4, 20000), write("0x6084 0", 4, 20000),
    write("0x607A 0", 4, 60000), write("0x6040 0", 2, 31));
  for (let step = 0; step < 90; ++step) await plant.control("pass 50ms");
}

/// A Modbus TCP client: request(function, ...words) resolves with the response's words.
export async function modbusClient(address) {
  const [host, port] = address.split(":");
  const socket = connect(Number(port), host);
  await once(socket, "connect");
  return {
    async request(code, first, ...words) {
      const body = code === 16 ? [words.length >> 8, words.length & 255, words.length * 2, ...words.flatMap((word) => [word >> 8, word & 255])]
        : [words[0] >> 8, words[0] & 255];
      socket.write(Buffer.from([0, 1, 0, 0, 0, body.length + 4, 1, code, first >> 8, first & 255, ...body]));
      const [response] = await once(socket, "data");
      return Array.from({ length: (response.length - 9) >> 1 }, (_, at) => response.readUInt16BE(9 + 2 * at));
    },
    close: () => socket.destroy(),
  };
}
