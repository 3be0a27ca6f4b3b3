// SPDX-License-Identifier: MIT
// A simulated CANopen plant for tests in JavaScript, and what loads its WebAssembly module, in Node.js and in a browser.
// plant.d.mts is the manual.

const encoder = new TextEncoder();
const decoder = new TextDecoder();

/** JSON without halves of characters, which UTF-8 does not have. */
const json = (value) => JSON.stringify(value, (_, part) => (typeof part === "string" ? decoder.decode(encoder.encode(part)) : part));

/** Of a number of seconds, or of a text as commands have it. */
const duration = (time) => (typeof time === "number" ? `${Math.round(time * 1e6)}us` : time);

export class PlantError extends Error {}

/** One instance of the module; hostsim/module/instance.hpp has its calls. */
export class Instance {
  #exports;
  #number = 0; // in the module
  #last = 0;

  constructor(module) {
    if (!module) return;
    this.#exports = new WebAssembly.Instance(module, {}).exports;
    this.#exports._initialize();
  }

  /** A plant for a trial in the same memory, until it is forgotten. */
  another() {
    const other = new Instance();
    other.#exports = this.#exports;
    other.#number = ++this.#last;
    return other;
  }
  forget() {
    this.#do("forget", this.#number);
  }

  /** After a trap its memory is in no known state, so nothing is done with it any more. */
  #do(name, ...numbers) {
    if (this.crash) throw this.crash;
    try {
      this.#exports.use(this.#number);
      return this.#exports[name](...numbers);
    } catch (error) {
      throw (this.crash = new PlantError(`the plant has crashed and cannot go on: ${error.message ?? "an exception"}`, { cause: error }));
    }
  }

  #put(...parts) {
    const at = this.#do("in", parts.reduce((size, part) => size + part.length, 0));
    const memory = new Uint8Array(this.#exports.memory.buffer, at);
    parts.reduce((offset, part) => (memory.set(part, offset), offset + part.length), 0);
  }

  #got() {
    return new Uint8Array(this.#exports.memory.buffer, this.#do("out"), this.#do("out_size"));
  }

  call(name, given = {}) {
    this.#put(encoder.encode(json({ ...given, call: name })));
    this.#do("call");
    return JSON.parse(decoder.decode(this.#got()));
  }

  /** `read` and `list` return what files and folders have, or null, at once or later. */
  async start(args, { read, list = () => null, folder = "/", environment = {} }) {
    return this.#complete(() => this.call("start", { arguments: args, folder, environment }), read, list);
  }

  async play(place, { read }) {
    return this.#complete(() => this.call("play", { place }), read, () => null);
  }

  async #complete(attempt, read, list) {
    for (let result = attempt(); ; result = attempt()) {
      if (!result.files) return result;
      for (const name of result.files) this.#give(name, false, await read(name));
      for (const name of result.folders) this.#give(name, true, (await list(name))?.join("\n"));
    }
  }

  #give(name, isFolder, content) {
    const bytes = encoder.encode(name);
    this.#put(bytes, typeof content === "string" ? encoder.encode(content) : (content ?? new Uint8Array()));
    this.#do("give", bytes.length, isFolder, content != null);
  }

  /** Microseconds, also of the next call; Infinity = never. */
  pass(now) {
    return this.#do("pass", now);
  }

  // ---- Connections

  receive(connection, bytes) {
    this.#put(bytes);
    this.#do("receive", connection);
  }
  endInput(connection) {
    this.#do("end_input", connection);
  }
  /** A copy of what is to be sent, in pieces. */
  *sent(connection) {
    for (;;) {
      this.#do("take", connection);
      const bytes = this.#got().slice();
      if (bytes.length === 0) return;
      yield bytes;
    }
  }
  state(connection) {
    const bits = this.#do("state", connection);
    return { wantsMore: (bits & 1) !== 0, isBusy: (bits & 2) !== 0, hasEnded: (bits & 4) !== 0 };
  }
  disconnect(connection) {
    this.#do("disconnect", connection);
  }
}

/** Microseconds since it was made. After a sleep of the machine the plant goes on where it was: `slept` gets how many seconds. */
export class Clock {
  static #kMostBehind = 10e6;
  #base = performance.now();
  #last = 0;
  #slept;

  constructor(slept = () => {}) {
    this.#slept = slept;
  }

  now() {
    const passed = (performance.now() - this.#base) * 1000 - this.#last;
    if (passed <= Clock.#kMostBehind) return (this.#last += Math.floor(passed));
    this.#base += passed / 1000;
    this.#slept(passed / 1e6);
    return this.#last;
  }
}

/** The plant of a test, in virtual time. */
export class Plant {
  #instance;
  #control;
  #events;

  static async open({ module, args = ["--demo"], files = {}, read = () => null }) {
    const plant = new this();
    await plant.#start(module, args, (name) => files[name] ?? read(name));
    return plant;
  }

  async #start(module, args, read) {
    this.#instance = new Instance(module);
    const manual = [...args, "--clock", "manual", "--control", ":0", "--http", ":0"];
    const started = await this.#instance.start(manual, { read });
    if (!started.services) throw new PlantError(this.#told("err").trimEnd() || `it has ended with exit code ${started.exit}`);
    this.#instance.call("serve", { places: ["control :1", "http :2"], since_1970: 0, alone: true });
    this.#control = this.#instance.call("connect", { service: "control", peer: "" });
    const request = { method: "GET", path: "/api/events", query: { kinds: "frame" }, host: "localhost", last_event_id: "0" };
    this.#events = this.#instance.call("respond", request).stream;
  }

  #told(wanted) {
    return this.#instance.call("told").filter(([to]) => to === wanted).map(([, text]) => text).join("");
  }

  #execute(line) {
    this.#instance.receive(this.#control, encoder.encode(`${line}\n`));
    const parts = [];
    do {
      this.#instance.pass(0);
      for (const part of this.#instance.sent(this.#control)) parts.push(decoder.decode(part));
    } while (this.#instance.state(this.#control).isBusy);
    return parts.join("").trimEnd();
  }

  command(line) {
    const response = this.#execute(line);
    const begin = response.lastIndexOf("\n") + 1;
    const last = response.slice(begin);
    if (last.startsWith("error: ")) throw new PlantError(last.slice("error: ".length));
    return (response.slice(0, begin) + last.replace(/^(ok|at) ?/, "")).trimEnd();
  }

  write(first, words, unit = 1) {
    this.command(`write ${unit}/${first} ${words.join(" ")}`);
  }

  registers(first, count, unit = 1) {
    return this.command(`read ${unit}/${first} ${count}`).split(" ").map(Number);
  }

  get now() {
    return Number(this.command("time"));
  }

  advance(time) {
    this.command(`pass ${duration(time)}`);
  }

  wait(condition, within = 60) {
    const response = this.#execute(`wait ${condition} within ${duration(within)}`);
    if (response.startsWith("ok")) return true;
    if (response.startsWith("error: not within ")) return false;
    throw new PlantError(response.replace("error: ", ""));
  }

  holds(condition) {
    return this.wait(condition, 0);
  }

  frames() {
    const frames = [];
    for (;;) {
      const { text } = this.#instance.call("fill", { stream: this.#events });
      if (text === "") return frames;
      for (const [, json] of text.matchAll(/^data: (.*)$/gm)) {
        const event = JSON.parse(json);
        if (event.kind === "frame") frames.push((event.network === 1 ? "" : `${event.network}/`) + event.frame);
      }
    }
  }
}
