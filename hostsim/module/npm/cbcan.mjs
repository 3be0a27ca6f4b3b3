#!/usr/bin/env node
// SPDX-License-Identifier: MIT
// cbcan-sim on Node.js: files, sockets, the clock and processes for the plant in the WebAssembly module.

import { spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import fs from "node:fs";
import net from "node:net";
import os from "node:os";
import path from "node:path";
import process from "node:process";
import { setTimeout as delay } from "node:timers/promises";
import v8 from "node:v8";

// Before version 22 Node.js takes as long to optimise the start as the start itself.
if (parseInt(process.versions.node) < 22) v8.setFlagsFromString("--wasm-tiering-budget=60000000");
const { Files, UsageError, hasTerminal, reason, warn } = await import("./files.mjs");
const { disk, module } = await import("./index.mjs");
const { Links, endStream, kKeepAlive } = await import("./links.mjs");
const { Clock, Instance } = await import("./plant.mjs");

const kUsage = 2;
const kEnvironment = 3;
const kLongestLine = 1000; // of standard input
const kMostHttpClients = 128;
const kMostBody = 64 * 1024;
const kSilentFor = 30_000; // ms, a client of HTTP with an incomplete request
const kHalfRequest = 5000; // ms, of Modbus
const kLeaving = 1000; // ms, for what clients have not read at the end
const kLongestTrial = 60_000; // ms
const kMostSaid = 2000; // characters of a trial's standard error
const kSignals = ["SIGINT", "SIGTERM", "SIGHUP"];

/** The bytes of a path, which need not be characters. */
const decoded = (path) =>
  Buffer.from(path.replace(/%([0-9a-f]{2})/gi, (_, hex) => String.fromCharCode(parseInt(hex, 16))), "latin1").toString();

const address = ({ host, port }) => `${host.includes(":") ? `[${host}]` : host}:${port}`;

const wayOut = ({ host, port }) => ({
  EACCES: `permission denied; use ${address({ host, port: port + 1000 })}`,
  EADDRINUSE: `address in use: another program listens there; stop it, or use ${address({ host, port: 0 })} for any free port`,
  EADDRNOTAVAIL: "not an address of this machine; 0.0.0.0 is all of them",
});

const trials = new Set(); // their commands, each the first of a process group

/** Signals a command and those that it has started. */
function signalGroup(child, signal) {
  if (process.platform === "win32") return spawnSync("taskkill", ["/pid", child.pid, "/t", "/f"]);
  try {
    process.kill(-child.pid, signal);
  } catch {
    // All of them have ended.
  }
}

const endTrials = () => trials.forEach((child) => signalGroup(child, "SIGKILL"));

class Program {
  #instance;
  #files = new Files();
  #clock = new Clock((seconds) => warn(`this machine or program stood still for ${seconds.toFixed(0)} s; so did the plant`));
  #folder = process.cwd().replaceAll(path.sep, "/");
  #hadTerminal = hasTerminal();
  #clients = new Map(); // from their sockets
  #streams = new Map(); // to their numbers and responses
  #servers = [];
  #turning = false;
  #timer;
  #links;
  #lines; // of standard input, not yet executed
  #child;
  #spawn; // starts the command
  #said; // the end of a trial's standard error
  #ended; // resolves a trial
  #code; // the exit code, once it is known

  constructor(instance) {
    this.#instance = instance;
    this.#links = new Links({
      instance,
      attach: (stream, link) => this.#attach(stream, link),
      soon: () => this.#soon(),
      pass: () => this.#instance.pass(this.#clock.now()),
      isRunning: () => this.#code === undefined,
      fail,
    });
  }

  async run(args) {
    process.stdout.on("error", (error) => fail(new Error(`standard output: ${reason(error)}`)));
    process.stderr.on("error", () => {});
    const started = await this.#instance.start(args, { ...disk, folder: this.#folder, environment: process.env });
    this.#tell();
    if (started.scenarios !== undefined) return this.#play(started);
    if (started.search !== undefined) return this.#search(started.search, started.command);
    if (started.exit !== undefined) return (process.exitCode = started.exit);
    const served = await this.#open(started);
    for (const signal of kSignals) process.on(signal, () => this.#onSignal(signal));
    if (!this.#spawn) this.#ready(served);
    this.#turn();
  }

  /** Listens, switches the plant on and starts the command. */
  async #open(started) {
    this.started = started;
    const listening = started.services.map((service) => this.#listen(service));
    const places = await Promise.all(listening);
    const served = this.#instance.call("serve", { places, since_1970: Date.now() * 1000, alone: false });
    await Promise.all(started.links.map((link) => this.#links.keep(link)));
    const variables = Object.fromEntries(served.environment.map((line) => line.split(/=(.*)/s, 2)));
    if (started.command.length > 0) (this.#spawn = () => this.#start(started.command, { ...process.env, ...variables }))();
    return served;
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

  // ---- A search

  async #search({ state, cut_to: size, out, junit, jobs, budget }, command) {
    if (out !== "") this.#files.makeFolder("--out", out);
    const write = (option, name, text, flag, instead) => {
      try {
        if (name !== "") fs.writeFileSync(name, text, { flag });
      } catch (error) {
        throw new Error(`${option} ${name}: ${reason(error)}; ${instead} another file`);
      }
    };
    const keep = (text) => write("--state", state, text, "a", "name");
    const conclude = (text) => write("--junit", junit, text, "w", "write");
    keep("");
    conclude("");
    if (size !== null) fs.truncateSync(state, size);
    process.on("exit", endTrials);
    for (const signal of kSignals) process.once(signal, () => (endTrials(), process.kill(process.pid, signal)));
    const begun = performance.now();
    const passed = () => Math.floor((performance.now() - begun) * 1000);
    const atATime = jobs || (os.availableParallelism?.() ?? os.cpus().length);
    const attempt = command
      ? (trial) => new Program(this.#instance.another()).try(trial)
      : (trial) => this.#instance.call("try_here", { trial });
    for (;;) {
      const found = this.#instance.call("search", { passed: passed(), most: 4 * atATime });
      keep(found.kept);
      if (process.stderr.isTTY) process.stderr.write(`\r${found.exit === undefined ? found.progress : ""}\x1b[K`);
      this.#tell();
      if (found.exit !== undefined) {
        conclude(found.junit ?? "");
        return (process.exitCode = found.exit);
      }
      const left = Array.from({ length: found.trials }, (_, trial) => trial);
      const slow = [];
      const work = async () => {
        while (left.length > 0 && (left.length === found.trials || passed() < budget)) {
          const trial = left.shift();
          if ((await attempt(trial)) !== null) slow.push(trial);
        }
      };
      await Promise.all(Array.from({ length: atATime }, work));
      for (const trial of slow) {
        const said = await attempt(trial); // alone
        if (said !== null) this.#instance.call("hang", { trial, limit: kLongestTrial * 1000, said });
      }
    }
  }

  /** A trial of a command. Returns null, or what the command has said that has not ended in time. */
  async try(trial) {
    const started = this.#instance.call("begin_trial", { trial });
    if (started.exit === undefined) {
      this.#said = "";
      const ended = new Promise((resolve) => (this.#ended = resolve));
      await this.#open(started);
      const limit = setTimeout(() => this.#stop(null), kLongestTrial);
      this.#turn();
      const code = await ended;
      clearTimeout(limit);
      await this.#leave();
      if (code !== null) this.#instance.call("end_trial", { code, said: this.#said });
      this.#code = code;
    }
    this.#instance.forget();
    return this.#code === null ? this.#said : null;
  }

  /** Nothing is left of a trial's command, and all that it has said is there. */
  async #leave() {
    const child = this.#child;
    signalGroup(child, "SIGKILL");
    trials.delete(child);
    if (child.pid && !child.stderr.closed) await Promise.race([once(child.stderr, "close"), delay(kLeaving, null, { ref: false })]);
    child.stderr?.destroy(); // a process that has left the group may have it
    for (const server of this.#servers) server.close();
    const sockets = [...this.#clients.keys(), ...this.#streams.keys()];
    this.#clients.clear();
    this.#streams.clear();
    for (const socket of sockets) socket.destroy();
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

  #start([program, ...args], env) {
    const inTrial = this.#ended !== undefined;
    const own = inTrial ? { stdio: ["ignore", "ignore", "pipe"], detached: process.platform !== "win32", windowsHide: true } : { stdio: "inherit" };
    const child = (this.#child = spawn(program, args, { ...own, env }));
    child.stderr?.setEncoding("utf8").on("data", (text) => (this.#said = (this.#said + text).slice(-kMostSaid)));
    child.on("error", (error) => {
      const why = `${program}: ${error.code === "ENOENT" ? "No such file or directory" : error.message}`;
      inTrial ? (this.#said += `cbcan-sim: ${why}\n`) : warn(why);
      this.#stop(error.code === "ENOENT" ? 127 : 126);
    });
    child.on("exit", (code, signal) => child === this.#child && this.#stop(code ?? 128 + os.constants.signals[signal]));
    if (inTrial && child.pid) trials.add(child);
  }

  #restart() {
    this.#signal("SIGKILL");
    this.#spawn?.();
  }

  /** A hangup of its terminal ends it; of another program, it opens the logs again. */
  #onSignal(signal) {
    const fromProgram = signal === "SIGHUP" && process.platform !== "win32" && this.#hadTerminal === hasTerminal();
    if (fromProgram && this.#files.reopenLogs()) return;
    this.#child ? this.#child.kill(signal) : this.#stop(0);
  }

  #signal(signal) {
    this.#ended ? signalGroup(this.#child, signal) : this.#child?.kill(signal);
  }

  /** Prints and writes what the plant has told. */
  #tell() {
    for (const [to, text, how] of this.#instance.call("told")) {
      if (to === "end") this.#child ? this.#signal("SIGTERM") : this.#stop(Number(text));
      else if (to === "stop") this.#stop(os.constants.signals.SIGKILL);
      else if (to === "restart") this.#restart();
      else if (this.#ended) continue; // a trial prints nothing
      else if (to === "out") process.stdout.write(text);
      else if (to === "err") process.stderr.write(text);
      else if (how?.megabytes !== undefined) this.#files.openLog(to, how);
      else if (how) text === "" ? this.#files.create(to) : this.#files.replace(to, text);
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
    const wait = Math.min(Math.ceil((Math.min(next, this.#links.poll()) - now) / 1000), most);
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
    this.#code = code;
    clearTimeout(this.#timer);
    if (this.#ended) return this.#ended(code);
    process.exitCode = code;
    if (this.started.summary) process.stderr.write(this.#instance.call("summary"));
    for (const server of this.#servers) server.close();
    for (const [socket, { connection }] of this.#clients) {
      for (const bytes of this.#instance.sent(connection)) socket.write(bytes);
      socket.destroySoon ? socket.destroySoon() : endStream(socket);
    }
    this.#links.end();
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
    this.#attach(socket, { service, peer });
  }

  #attach(socket, from) {
    const client = { connection: this.#instance.call("connect", from), unread: Buffer.alloc(0), isModbus: from.service === "modbus", wasHalf: false };
    this.#clients.set(socket, client);
    const serve = () => {
      if (this.#code !== undefined) return;
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
      if (this.#clients.delete(socket) && !this.#instance.crash) this.#instance.disconnect(client.connection);
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
    if (hasEnded || (client.ended && !isBusy && !waits))
      socket.destroySoon ? socket.destroySoon() : endStream(socket);
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
new Program(new Instance(module))
  .run(args.map((word, place) => (place < own ? word.replaceAll(path.sep, "/") : word)))
  .catch(fail);
