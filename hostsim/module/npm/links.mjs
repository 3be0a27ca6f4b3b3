// SPDX-License-Identifier: MIT
// Streams that the program makes, and makes again: serial lines, a bus elsewhere, PLCs that own their registers.

import net from "node:net";
import { setTimeout as delay } from "node:timers/promises";

import { UsageError, reason, warn } from "./files.mjs";

export const kKeepAlive = { keepAlive: true, keepAliveInitialDelay: 60_000 }; // Node.js adds ten probes, one a second
const kRetry = 1000; // ms, between attempts to open a link
const kPlcTimeout = 1000;
const kShortestPause = 100, kLongestPause = 5000; // ms, between attempts to connect to a PLC
const kParities = { E: "even", O: "odd", N: "none" };

/** An optional dependency. */
const dependency = (name, purpose) =>
  import(name).catch(() => {
    throw new UsageError(`${purpose} needs the package ${name}, which is not installed; npm install ${name}`);
  });

/** A socket or serial port that is not open yet. */
async function streamOf({ name, device, baud, parity, host, port }) {
  if (device === "") return net.connect({ host, port, ...kKeepAlive, noDelay: true });
  const { SerialPort } = await dependency("serialport", `${name} ${device}`);
  return new SerialPort({ path: device, baudRate: baud, parity: kParities[parity], stopBits: parity === "N" ? 2 : 1 });
}

/** Ends the stream of a link; a serial port stays open without close(). */
export function endStream(stream, why) {
  stream.why ??= why;
  stream.isOpen ? stream.close() : stream.destroy();
}

export class Links {
  #host; // { instance, attach, soon, pass, isRunning, fail }
  #plcs = new Set(); // that are connected

  constructor(host) {
    this.#host = host;
  }

  /** Opens it, and again when it has ended. A line of Modbus RTU has to be there at the start, and is waited for. */
  keep(link) {
    return new Promise((tried, failed) => {
      this.#keepOpen(link, tried).catch(link.name === "rtu" ? failed : this.#host.fail);
      if (link.name !== "rtu") tried();
    });
  }

  async #keepOpen(link, tried) {
    const isPlc = link.name === "plc";
    const where = `${link.name} ${link.device}: `;
    const modbus = isPlc && (await dependency("jsmodbus", "--plc")).default.client;
    for (let pause = kShortestPause, lost = false; this.#host.isRunning(); pause = Math.min(2 * pause, kLongestPause)) {
      const stream = await streamOf(link);
      let why = "";
      const closed = new Promise((resolve) => {
        stream.on("error", (error) => (why = error.code ? reason(error) : error.message));
        stream.on("error", resolve).on("close", () => resolve((why ||= stream.why ?? (isPlc ? "closed by the other side" : "the connection has ended"))));
      });
      const opened = new Promise((resolve) => stream.once(link.device === "" ? "connect" : "open", () => resolve(true)));
      const plc = isPlc && { stream, network: link.network, unit: link.unit, quiet: link.device === "" ? 0 : Math.max(2, 38_500 / link.baud), client: new modbus[link.device === "" ? "TCP" : "RTU"](stream, link.unit, kPlcTimeout) };
      const limit = isPlc && setTimeout(() => endStream(stream, "no response"), kPlcTimeout);
      const isOpen = await Promise.race([opened, closed.then(() => false)]);
      clearTimeout(limit);
      if (isOpen) {
        tried();
        if (link.name === "rtu" && lost) warn(`${where}is there again`);
        lost = false;
        if (isPlc) this.#plcs.add(plc);
        else this.#host.attach(stream, link);
        this.#host.soon();
        await closed;
        this.#plcs.delete(plc);
        if (plc?.answered) pause = kShortestPause;
      } else if (link.name === "rtu" && !lost) {
        throw new Error(`${where}${why}`);
      }
      if (!this.#host.isRunning()) return;
      if (link.name === "rtu" && !lost) warn(`${where}is gone; plug it in again, it is looked for every second`);
      lost = true;
      this.#host.instance.call("lose", { ...link, why });
      this.#host.soon();
      await delay(isPlc ? pause : kRetry);
    }
  }

  /** Asks PLCs that have no request; returns when there is the next one. */
  poll() {
    let at = Infinity;
    for (const plc of this.#plcs) {
      if (plc.isBusy) continue;
      const request = this.#host.instance.call("plc", { network: plc.network });
      if (request.at === undefined) this.#ask(plc, request);
      else at = Math.min(at, request.at);
    }
    return at;
  }

  async #ask(plc, { first, count, words }) {
    plc.isBusy = true;
    const writes = words.length > 0;
    let outcome;
    try {
      const { response } = await (writes ? plc.client.writeMultipleRegisters(first, words) : plc.client.readHoldingRegisters(first, count));
      outcome = { words: writes ? [] : Array.from(response.body.valuesAsArray) };
      const isOther = (response.address ?? response.unitId) !== plc.unit; // jsmodbus does not look
      if (isOther || (!writes && outcome.words.length !== count)) return endStream(plc.stream, "what it answers is no Modbus");
    } catch (error) {
      if (error.err !== "ModbusException") return endStream(plc.stream, error.err === "Timeout" ? "no response" : "what it answers is no Modbus");
      outcome = { exception: error.response.body.code };
    }
    if (plc.quiet > 0) await delay(plc.quiet);
    if (!this.#host.isRunning() || plc.stream.destroyed) return;
    plc.answered = true;
    plc.isBusy = false;
    this.#host.pass();
    this.#host.instance.call("plc", { network: plc.network, ...outcome });
    this.#host.soon();
  }

  end() {
    for (const { stream } of this.#plcs) endStream(stream);
  }
}
