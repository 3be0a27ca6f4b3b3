// SPDX-License-Identifier: MIT
// A browser on the page of a running cbcan-sim, and a short Modbus client.
import { once } from "node:events";
import { connect } from "node:net";
import puppeteer from "puppeteer-core";
import { LIMIT, startSimulator } from "./cases.mjs";

export const WIDE = { width: 1280, height: 860 }, NARROW = { width: 390, height: 844 };

export const launch = () => puppeteer.launch({ executablePath: "/usr/bin/chromium", protocolTimeout: LIMIT,
  args: ["--no-sandbox", "--disable-gpu", "--force-color-profile=srgb"] });

/// cbcan-sim with its page; `control` sends commands and returns the responses.
export async function startPlant(program, options = [], http = "127.0.0.1:0") {
  const simulator = await startSimulator(program, "--demo", "--modbus", "127.0.0.1:0", "--http", http, ...options);
  const url = `http://${simulator.where.http}`;
  const control = async (...lines) => (await fetch(`${url}/api/control`, { method: "POST", body: lines.join("\n") })).text();
  return { ...simulator, url, control };
}

/// The page, once it is live; `errors` has its errors, and each request to another site.
export async function open(browser, { url }, { size = WIDE, scheme = "light" } = {}) {
  const page = await browser.newPage();
  page.setDefaultTimeout(LIMIT);
  page.errors = [];
  page.on("pageerror", (error) => page.errors.push(String(error.stack)));
  page.on("console", (message) => { if (message.text().includes("Security Policy")) page.errors.push(message.text()); });
  page.on("request", (request) => { if (!/^(blob:)?http:\/\/127/.test(request.url())) page.errors.push(`asks ${request.url()}`); });
  await page.setViewport(size);
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }, { name: "prefers-reduced-motion", value: "reduce" }]);
  await page.goto(url);
  await page.waitForFunction(() => document.querySelector("#live").textContent === "live");
  await page.waitForSelector("#register-list .row");
  return page;
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
