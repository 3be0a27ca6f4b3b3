// SPDX-License-Identifier: MIT
// Messages, and files that are written.

import fs from "node:fs";
import path from "node:path";
import process from "node:process";

export const warn = (text) => process.stderr.write(`cbcan-sim: ${text}\n`);

/** An error that ends the program with kUsage; any other ends it with kEnvironment. */
export class UsageError extends Error {}

/** "no such file or directory" of Node.js' "ENOENT: no such file or directory, open 'x'". */
export const reason = ({ message }) => message.replace(/^E\w+: ([^,]*).*$/s, "$1");

/** Files that are written. */
export class Files {
  #opened = new Map();

  create(name) {
    const folder = path.dirname(name);
    if (!fs.existsSync(folder)) throw new UsageError(`${name}: there is no folder ${folder}; make it first`);
    try {
      this.#opened.set(name, fs.openSync(name, "w"));
    } catch (error) {
      throw new Error(`${name}: ${reason(error)}; write another file`);
    }
  }

  /** Makes the folder of an option unless it is there. */
  makeFolder(option, name) {
    try {
      fs.mkdirSync(name, { recursive: true });
    } catch (error) {
      const why = error.code === "EEXIST" ? "not a directory" : reason(error);
      throw new UsageError(`${option} ${name}: ${why[0].toUpperCase()}${why.slice(1)}; name another folder`);
    }
  }

  replace(name, text) {
    try {
      fs.writeFileSync(`${name}.new`, text, { flush: true });
      fs.renameSync(`${name}.new`, name);
    } catch (error) {
      warn(`${name}: ${reason(error)}; what was there before stays`);
    }
  }

  add(name, text) {
    const file = this.#opened.get(name);
    try {
      if (file !== undefined) fs.writeSync(file, text);
    } catch (error) {
      this.#opened.delete(name);
      warn(`${name}: ${reason(error)}; it ends here, the simulation goes on`);
    }
  }
}
