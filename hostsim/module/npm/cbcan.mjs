#!/usr/bin/env node
// SPDX-License-Identifier: MIT
// cbcan-sim on Node.js: files, sockets, the clock and processes for the plant in the WebAssembly module.

import { spawn } from "node:child_process";
import fs from "node:fs";
import net from "node:net";
import os from "node:os";
import path from "node:path";
import process from "node:process";
import v8 from "node:v8";

// Before version 22 Node.js takes as long to optimise the start as the start itself.
if (parseInt(process.versions.node) < 22) v8.setFlagsFromString("--wasm-tiering-budget=60000000");
const { disk, module } = await import("./index.mjs");
const { Clock, Instance } = await import("./plant.mjs");

const kUsage = 2;
const kEnvironment = 3;
const kLongestLine = 1000; // of standard input
const kMostHttpClients = 128;
const kMostBody = 64 * 1024;
const kSilentFor = 30_000; // ms, a client of HTTP with an incomplete request
const kHalfRequest = 5000; // ms, of Modbus
const kKeepAlive = { keepAlive: true, keepAliveInitialDelay: 60_000 }; // Node.js adds ten probes, one a second
const kLeaving = 1000; // ms, for what clients have not read at the end

const warn = (text) => process.stderr.write(`cbcan-sim: ${text}\n`);

/** An error that ends the program with kUsage; any other ends it with kEnvironment. */
class UsageError extends Error {}

/** "no such file or directory" of Node.js' "ENOENT: no such file or directory, open 'x'". */
const reason = ({ message }) => message.replace(/^E\w+: ([^,]*).*$/s, "$1");

/** Files that are written. */
class Files {
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
      const why = reason(error);
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

/** The bytes of a path, which need not be characters. */
const decoded = (path) =>
  Buffer.from(path.replace(/%([0-9a-f]{2})/gi, (_, hex) => String.fromCharCode(parseInt(hex, 16))), "latin1").toString();

const address = ({ host, port }) => `${host.includes(":") ? `[${host}]` : host}:${port}`;

const wayOut = ({ host, port }) => ({
  EACCES: `permission denied; use ${address({ host, port: port + 1000 })}`,
  EADDRINUSE: `address in use: another program listens there; stop it, or use ${address({ host, port: 0 })} for any free port`,
  EADDRNOTAVAIL: "not an address of this machine; 0.0.0.0 is all of them",
});

class Program {
  #instance = new Instance(module);
  #files = new Files();
  #clock = new Clock((seconds) => warn(`this machine or program stood still for ${seconds.toFixed(0)} s; so did the plant`));
  #folder = process.cwd().replaceAll(path.sep, "/");
  #clients = new Map(); // from their sockets
  #streams = new Map(); // to their numbers and responses
  #servers = [];
  #turning = false;
  #timer;
  #lines; // of standard input, not yet executed
  #child;
  #code; // the exit code, once it is known

  async run(args) {
    process.stdout.on("error", (error) => fail(new Error(`standard output: ${reason(error)}`)));
    process.stderr.on("error", () => {});
    const started = await this.#instance.start(args, { ...disk, folder: this.#folder });
    this.#tell();
    if (started.scenarios !== undefined) return this.#play(started);
    if (started.exit !== undefined) return (process.exitCode = started.exit);
    this.started = started;
    const listening = started.services.map((service) => this.#listen(service));
    const places = await Promise.all(listening);
    const served = this.#instance.call("serve", { places, since_1970: Date.now() * 1000, alone: false });
    for (const signal of ["SIGINT", "SIGTERM", "SIGHUP"])
      process.on(signal, () => (this.#child ? this.#child.kill(signal) : this.#stop(0)));
    if (started.command.length > 0) this.#spawn(started.command, served.environment);
    else this.#ready(served);
    this.#turn();
  }

  // ---- Scenarios

  async #play({ scenarios, log, junit }) {
    if (log !== "") this.#files.makeFolder("--log", log);
    if (junit !== "" && junit !== "-") this.#files.create(junit);
    const progress = (text) => process.stderr.isTTY && process.stderr.write(text);
    for (let place = 0; place < scenarios; ++place) {
      const played = await this.#instance.play(place, disk);
      for (const [name, text] of played.log) fs.writeFileSync(path.join(log, name), text);
      progress(`\r${place + 1} of ${scenarios}, ${played.failed} failed\x1b[K`);
    }
    progress("\r\x1b[K");
    const { exit, junit: results } = this.#instance.call("played");
    this.#tell();
    if (junit === "-") process.stdout.write(results);
    else if (junit !== "") this.#files.add(junit, results);
    process.exitCode = exit;
  }

  // ---- A plant

  #ready({ ready, ways_in: waysIn }) {
    process[this.started.ready_to === "out" ? "stdout" : "stderr"].write(ready);
    process.stderr.write(waysIn);
    if (!this.started.manual) return;
    if (fs.statSync("/dev/stdin", { throwIfNoEntry: false })?.isDirectory()) throw new Error("standard input: Is a directory");
    this.#lines = [];
    let rest = "";
    process.stdin.setEncoding("utf8").on("data", (text) => {
      const lines = (rest + text).split(/\r?\n/);
      rest = lines.pop();
      if ([...lines, rest].some((line) => line.length > kLongestLine))
        fail(new UsageError(`standard input: a line of more than ${kLongestLine} characters`));
      this.#lines.push(...lines);
      process.stdin.pause();
      this.#soon();
    });
    process.stdin.on("error", (error) => fail(new Error(`standard input: ${reason(error)}`)));
    process.stdin.on("end", () => {
      this.#lines.push(...(rest === "" ? [] : [rest]), null);
      this.#soon();
    });
  }

  #spawn([program, ...args], environment) {
    const variables = Object.fromEntries(environment.map((line) => line.split(/=(.*)/s, 2)));
    this.#child = spawn(program, args, { stdio: "inherit", env: { ...process.env, ...variables } });
    this.#child.on("error", (error) => {
      warn(`${program}: ${error.code === "ENOENT" ? "No such file or directory" : error.message}`);
      this.#stop(error.code === "ENOENT" ? 127 : 126);
    });
    this.#child.on("exit", (code, signal) => this.#stop(code ?? 128 + os.constants.signals[signal]));
  }

  /** Prints and writes what the plant has told. */
  #tell() {
    for (const [to, text, replaces] of this.#instance.call("told")) {
      if (to === "out") process.stdout.write(text);
      else if (to === "err") process.stderr.write(text);
      else if (to === "end") this.#child ? this.#child.kill() : this.#stop(Number(text));
      else if (replaces) text === "" ? this.#files.create(to) : this.#files.replace(to, text);
      else this.#files.add(to, text);
    }
  }

  /** Everything that has arrived is handled first. */
  #soon() {
    if (this.#turning) return;
    this.#turning = true;
    setImmediate(() => this.#turn());
  }

  #turn() {
    this.#turning = false;
    if (this.#code !== undefined) return;
    const now = this.#clock.now();
    const next = this.#instance.pass(now);
    this.#tell(); // before the responses to commands
    if (this.#code !== undefined) return;
    let received = false; // there may be more
    for (const [socket, client] of this.#clients) received = this.#serve(socket, client) || received;
    received ? this.#soon() : this.#execute();
    for (const [response, stream] of this.#streams) this.#fill(response, stream);
    this.#tell();
    clearTimeout(this.#timer);
    if (this.#code !== undefined) return;
    const most = this.#streams.size > 0 ? 20 : 2 ** 30;
    const wait = Math.min(Math.ceil((next - now) / 1000), most);
    if (wait <= 0) this.#soon();
    else this.#timer = setTimeout(() => this.#turn(), wait);
  }

  /** Lines of standard input, one after the other. */
  #execute() {
    while (this.#lines?.length > 0 && this.#code === undefined && !this.#instance.call("input_waits")) {
      const line = this.#lines.shift();
      if (line === null) return this.#stop(0);
      this.#instance.call("input", { line });
      this.#tell();
      this.#soon();
    }
    if (this.#lines?.length === 0) process.stdin.resume();
  }

  #stop(code) {
    if (this.#code !== undefined) return;
    process.exitCode = this.#code = code;
    clearTimeout(this.#timer);
    if (this.started.summary) process.stderr.write(this.#instance.call("summary"));
    for (const server of this.#servers) server.close();
    for (const [socket, { connection }] of this.#clients) {
      for (const bytes of this.#instance.sent(connection)) socket.write(bytes);
      socket.destroySoon();
    }
    for (const response of this.#streams.keys()) response.destroy();
    process.stdin.destroy();
    this.#tell();
    setTimeout(() => process.exit(), kLeaving).unref(); // who does not read is not waited for
  }

  // ---- Connections

  async #listen({ name, host, port }) {
    const server =
      name === "http"
        ? await this.#httpServer()
        : net.createServer({ ...kKeepAlive, allowHalfOpen: true, noDelay: true }, (socket) => this.#accept(name, socket));
    await new Promise((resolve, reject) => {
      const fail = (error) =>
        reject(new Error(`${name} ${address({ host, port })}: ${wayOut({ host, port })[error.code] ?? error.message}`));
      server.once("error", fail).listen({ host, port }, resolve);
    });
    this.#servers.push(server);
    return `${name} ${address({ host, port: server.address().port })}`;
  }

  #accept(service, socket) {
    if (socket.remoteAddress === undefined) return socket.destroy(); // reset meanwhile, which looks like a half-close later
    const peer = address({ host: socket.remoteAddress, port: socket.remotePort });
    const client = { connection: this.#instance.call("connect", { service, peer }), unread: Buffer.alloc(0), isModbus: service === "modbus", wasHalf: false };
    this.#clients.set(socket, client);
    const serve = () => {
      this.#instance.pass(this.#clock.now());
      this.#serve(socket, client);
      this.#soon();
    };
    socket.on("data", (bytes) => {
      client.unread = client.unread.length === 0 ? bytes : Buffer.concat([client.unread, bytes]);
      serve();
    });
    // A reset right behind bytes arrives as an end too; only a write fails then.
    socket.on("end", () => socket.writableEnded || socket.write("", (error) => error || ((client.ended = true), serve())));
    socket.on("drain", serve);
    socket.on("timeout", () => socket.destroy());
    socket.on("error", () => socket.destroy());
    socket.on("close", () => {
      this.#clients.delete(socket);
      if (!this.#instance.crash) this.#instance.disconnect(client.connection);
    });
    this.#serve(socket, client);
  }

  /** What each client of many is served of at a time: what one sends may go to all of them. */
  #share() {
    const kWork = 512 * 1024, kMost = 4096, kFewest = 32;
    return Math.max(kFewest, Math.min(kMost, Math.floor(kWork / this.#clients.size ** 2)));
  }

  /** Nothing more is read from a client that does not read. Returns whether bytes of the client were handed over. */
  #serve(socket, client) {
    const { connection } = client;
    if (socket.writableEnded) return void socket.pause();
    const reads = () => !socket.writableNeedDrain && this.#instance.state(connection).wantsMore;
    const receives = client.unread.length > 0 && reads();
    if (receives) {
      const share = this.#share();
      this.#instance.receive(connection, client.unread.subarray(0, share));
      client.unread = client.unread.subarray(share);
      this.#tell(); // files have what a response proves
      if (socket.writableEnded) return true;
    }
    if (client.ended && client.unread.length === 0) this.#instance.endInput(connection);
    if (!socket.writableNeedDrain)
      for (const bytes of this.#instance.sent(connection)) if (!socket.write(bytes)) break;
    const { isBusy, hasEnded } = this.#instance.state(connection);
    const waits = client.unread.length > 0;
    const isHalf = client.isModbus && isBusy && !waits && !socket.writableNeedDrain;
    if (isHalf !== client.wasHalf) socket.setTimeout((client.wasHalf = isHalf) ? kHalfRequest : 0);
    if (hasEnded || (client.ended && !isBusy && !waits)) socket.destroySoon();
    else waits || !reads() ? socket.pause() : socket.resume();
    return receives;
  }

  async #httpServer() {
    const { createServer } = await import("node:http");
    const idle = new Set(); // sockets without a request, the one that has had none for longest first
    let clients = 0;
    const server = createServer({ ...kKeepAlive, requestTimeout: kSilentFor, connectionsCheckingInterval: kSilentFor / 10 }, (request, response) => {
      const { socket } = request;
      idle.delete(socket);
      response.on("close", () => socket.destroyed || idle.add(socket));
      this.#respond(request, response).catch((error) => (this.#instance.crash ? fail(error) : response.destroy()));
    });
    return server.on("connection", (socket) => {
      idle.add(socket.on("close", () => (idle.delete(socket), --clients)));
      if (++clients <= kMostHttpClients) return;
      const [first] = idle; // the new one if all others are busy
      idle.delete(first);
      first.destroy();
    });
  }

  async #respond(request, response) {
    const parts = [];
    let size = 0;
    for await (const part of request) if ((size += part.length) <= kMostBody) parts.push(part);
    const [path, query] = request.url.split(/\?(.*)/s);
    this.#instance.pass(this.#clock.now());
    const answer = this.#instance.call("respond", {
      method: request.method,
      path: decoded(path),
      query: Object.fromEntries(new URLSearchParams(query)),
      body: Buffer.concat(parts).toString(),
      host: request.headers.host,
      origin: request.headers.origin,
      last_event_id: request.headers["last-event-id"],
      too_long: size > kMostBody,
    });
    this.#soon();
    if (!answer.stream)
      return response
        .writeHead(answer.status, { ...answer.headers, "Content-Length": Buffer.byteLength(answer.body) })
        .end(answer.body);
    const stream = { number: answer.stream, keepAlive: answer.keep_alive, sentAt: performance.now() };
    const drop = () => this.#streams.delete(response) && this.#instance.call("drop", { stream: stream.number });
    this.#streams.set(response, stream);
    if (response.destroyed) return drop();
    response.on("close", drop).writeHead(answer.status, answer.headers).flushHeaders();
  }

  #fill(response, stream) {
    const kKeepAlive = 5000;
    if (response.writableNeedDrain) return;
    const { text, more } = this.#instance.call("fill", { stream: stream.number });
    const silent = performance.now() - stream.sentAt > kKeepAlive;
    const sent = text || (silent ? stream.keepAlive : "");
    if (sent !== "") {
      stream.sentAt = performance.now();
      response.write(sent);
    }
    if (more) return;
    this.#streams.delete(response);
    response.end();
  }
}

/** Ends the program; also for what a callback throws. */
function fail(error) {
  warn(error.message);
  process.exit(error instanceof UsageError ? kUsage : kEnvironment);
}

process.on("uncaughtException", fail);

// Paths have slashes in the module, on every system.
const args = process.argv.slice(2);
const own = args.includes("--") ? args.indexOf("--") : args.length;
new Program()
  .run(args.map((word, place) => (place < own ? word.replaceAll(path.sep, "/") : word)))
  .catch(fail);
