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

/** Whether the process has a terminal, whose end is a hangup. */
export function hasTerminal() {
  try {
    fs.closeSync(fs.openSync("/dev/tty"));
    return true;
  } catch {
    return false;
  }
}

/** Files that are written. */
export class Files {
  #opened = new Map();
  #most = new Map(); // bytes of a log before it becomes NAME.1; 0: no limit

  openLog(name, { megabytes, continues }) {
    this.create(name, continues ? "a" : "w");
    this.#most.set(name, megabytes * 1e6);
  }

  /** After another program has renamed them. False: there are none. */
  reopenLogs() {
    for (const name of this.#most.keys()) {
      this.#close(name);
      try {
        this.create(name, "a");
      } catch ({ message }) {
        warn(message);
      }
    }
    return this.#most.size > 0;
  }

  #turnOver(name) {
    this.#close(name);
    fs.renameSync(name, `${name}.1`);
    this.create(name);
  }

  #close(name) {
    if (this.#opened.has(name)) fs.closeSync(this.#opened.get(name));
    this.#opened.delete(name);
  }

  create(name, flags = "w") {
    const folder = path.dirname(name);
    if (!fs.existsSync(folder)) throw new UsageError(`${name}: there is no folder ${folder}; make it first`);
    try {
      this.#opened.set(name, fs.openSync(name, flags));
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
    if (file === undefined) return;
    try {
      const most = this.#most.get(name);
      if (most > 0 && fs.fstatSync(file).size + text.length > most) this.#turnOver(name);
      fs.writeSync(this.#opened.get(name), text);
    } catch (error) {
      this.#opened.delete(name);
      warn(`${name}: ${reason(error)}; it ends here, the simulation goes on`);
    }
  }
}
