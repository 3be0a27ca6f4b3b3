// SPDX-License-Identifier: MIT
// The frames of the README's moving picture: a drive moves, then a node does not respond.
// usage: node moving_picture.mjs CBCAN_SIM FOLDER
import { mkdirSync } from "node:fs";
import { launch, open, shows, startPlant } from "./browser.mjs";

const [program, folder] = process.argv.slice(2);
const MOVE = [["0x6040", 2, 6], ["0x6040", 2, 7], ["0x6040", 2, 15], ["0x6060", 1, 1], ["0x6081", 4, 20000], ["0x6083", 4, 40000], ["0x6084", 4, 40000],
  ["0x607A", 4, 60000], ["0x6040", 2, 31]];
mkdirSync(folder, { recursive: true });
const browser = await launch(), plant = await startPlant(program, ["--clock", "manual"]);
const page = await open(browser, plant, { size: { width: 1280, height: 800 } });
let frames = 0;

async function film(count, step) {
  for (let i = 0; i < count; ++i) {
    await plant.control(`pass ${step}`);
    const { time } = await plant.about();
    await page.waitForFunction((now) => document.querySelector("#facts dd").textContent.endsWith(now), {}, (time % 60).toFixed(3).padStart(6, "0"));
    await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
    await page.screenshot({ path: `${folder}/${String(++frames).padStart(3, "0")}.png` });
  }
}

await plant.control("nmt start all", "set 66 0x6401:1 1250", "set 66 0x6000:1 5");
for (const object of ["66 0x1000 0 4", "1 0x9130 1 4", "2 0x9130 1 4", "66 0x6401 1 2", "66 0x6000 1 1", "16 0x1000 0 4", "32 0x1008 0 32", "16 0x6041 0 2"])
  await plant.control(`trigger read ${object}`, "pass 10ms");
await film(3, "100ms");
for (const [object, size, value] of MOVE)
  await plant.control(`trigger write 16 ${object} 0 ${size} ${value & 0xffff}${size === 4 ? ` ${value >> 16}` : ""}`, "pass 20ms");
await film(24, "150ms");
await plant.control("fault 66 response-never count=1", "trigger read 66 0x6000 1 1");
await film(8, "150ms");
await shows(page, "#verdict", /0504 0000h/);
await film(4, "250ms");
await browser.close();
await plant.stop();
