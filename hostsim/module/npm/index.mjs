// SPDX-License-Identifier: MIT
// The plant for tests on Node.js: with the module and files of this machine.

import fs from "node:fs";
import path from "node:path";

import * as plant from "./plant.mjs";

export const { PlantError } = plant;

export const module = new WebAssembly.Module(fs.readFileSync(new URL("./cbcan.wasm", import.meta.url)));

const unlessAbsent = (action) => {
  try {
    return action();
  } catch {
    return null;
  }
};

const isFile = (entry) => entry.isFile() || entry.isFIFO();
const namesIn = (folder) =>
  fs.readdirSync(folder, { withFileTypes: true })
    .filter(isFile)
    .map((entry) => `${entry.name}\n`)
    .sort()
    .join("");

/** Of a file that is too long no more than the module needs to say so. */
const kTooLong = 16 * 1024 * 1024 + 1;
const content = (name) => (fs.statSync(name).size < kTooLong ? fs.readFileSync(name) : new Uint8Array(kTooLong));

/** Files and folders, null = absent. Not devices, which may have no end. */
export const disk = {
  read: (name) => unlessAbsent(() => (name.endsWith("/") ? namesIn(name) : isFile(fs.statSync(name)) ? content(name) : null)),
  list: (name) =>
    unlessAbsent(() =>
      fs.readdirSync(name, { withFileTypes: true, recursive: true })
        .filter((entry) => entry.isFile() && entry.name.endsWith(".toml"))
        .map((entry) => path.join(entry.parentPath ?? entry.path, entry.name).replaceAll(path.sep, "/"))),
};

export class Plant extends plant.Plant {
  static open(options = {}) {
    return super.open({ module, read: disk.read, ...options });
  }
}
