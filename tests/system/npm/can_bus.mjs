// SPDX-License-Identifier: MIT
// The bus of a simulator for programs on Node.js: an SLCAN socket, or a SocketCAN interface through can-utils. Frames are
// { id, data }; on("frame") reports frames of other nodes.
import { spawn, spawnSync } from "node:child_process";
import { EventEmitter, once } from "node:events";
import { connect } from "node:net";
import { createInterface } from "node:readline";
import { setImmediate } from "node:timers/promises";

const MARK = "7E5#00";  // a request that no LSS slave knows

const hex = (data) => Buffer.from(data).toString("hex").toUpperCase();
const frameId = (id) => id.toString(16).toUpperCase().padStart(3, "0");

/// The bus at HOST:PORT, through an open adapter.
export async function slcanBus(address) {
  const [host, port] = address.split(":");
  const socket = connect({ host, port: Number(port), noDelay: true });
  const bus = new EventEmitter();
  let open, rest = "";
  const opened = new Promise((resolve) => (open = resolve));
  socket.on("data", (text) => {
    const lines = (rest + text.toString("latin1")).split("\r");
    rest = lines.pop();
    for (const line of lines) {
      const frame = /^z?t(...)(.)(.*)$/.exec(line);
      if (frame) bus.emit("frame", { id: parseInt(frame[1], 16), data: Buffer.from(frame[3], "hex") });
      if (line === "") open();
    }
  });
  bus.send = ({ id, data }) => socket.write(`t${frameId(id)}${data.length}${hex(data)}\r`);
  bus.close = () => socket.destroy();
  await once(socket, "connect");
  socket.write("O\r");
  await opened;
  return bus;
}

/// The interface `name`, through candump and canplayer.
export async function socketCanBus(name) {
  const candump = spawn("candump", ["-L", name], { stdio: ["ignore", "pipe", "inherit"] });
  const canplayer = spawn("canplayer", ["-t"], { stdio: ["pipe", "ignore", "inherit"] });
  const bus = new EventEmitter();
  const own = [];  // own frames, which candump also reports
  let listens = false;
  createInterface({ input: candump.stdout }).on("line", (line) => {
    listens = true;
    const text = line.split(" ")[2];
    if (text === MARK) return;
    const place = own.indexOf(text);
    if (place >= 0) return own.splice(place, 1);
    const [id, data] = text.split("#");
    bus.emit("frame", { id: parseInt(id, 16), data: Buffer.from(data, "hex") });
  });
  bus.send = ({ id, data }) => {
    const text = `${frameId(id)}#${hex(data)}`;
    own.push(text);
    canplayer.stdin.write(`(0.000000) ${name} ${text}\n`);
  };
  bus.close = () => {
    candump.kill();
    canplayer.kill();
  };
  while (!listens) {
    spawnSync("cansend", [name, MARK]);
    await setImmediate();
  }
  return bus;
}
