// SPDX-License-Identifier: MIT
// The simulated devices with npm's canopen as the master. On the interface that CBCAN_VCAN names, or else over SLCAN.
// usage: node canopen_test.mjs CBCAN_SIM SOURCE_FOLDER [SLAVE]
// SLAVE is the I/O module instead of the simulated one: the program of examples/slave, or its image for QEMU or rp2040js.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { createConnection } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";
import { slcanBus, socketCanBus } from "./can_bus.mjs";
import { LIMIT, count, running, startSimulator } from "./cases.mjs";

const [program, sources, slave] = process.argv.slice(2);
const vcan = slave ? undefined : process.env.CBCAN_VCAN;
const require = createRequire(import.meta.url);

// Replaces a native package of canopen, which is not built here: a CRC of 16 bits, not reflected, initial value 0.
function crc(...parameters) {
  const polynomial = parameters[2], data = parameters[8];
  let value = 0;
  for (const byte of data) {
    value ^= byte << 8;
    for (let i = 0; i < 8; ++i) value = ((value << 1) ^ (value & 0x8000 ? polynomial : 0)) & 0xffff;
  }
  return Buffer.from([value >> 8, value & 0xff]);
}
const native = require.resolve("node-crc");
require.cache[native] = { id: native, filename: native, loaded: true, exports: { crc } };
const { DataType, Device, Eds, LssMode, NmtState } = require("canopen");

const IO = 0x42, TRANSDUCER = 1, DRIVE = 5, GENERIC = 0x20;
const EDS = { [IO]: "io_module", [TRANSDUCER]: "pressure_transducer", [DRIVE]: "drive" };

/// The plant; without the I/O module if there is a slave.
function plant(folder) {
  const file = join(sources, "tests/system/devices.toml");
  if (!slave) return file;
  const text = readFileSync(file, "utf8").replaceAll("../../plants", join(sources, "plants"));
  const path = join(folder, "devices.toml");
  writeFileSync(path, text.replace(/\[\[node\]\]\nid = 0x42\n[^]*?(?=\[\[node\]\])/, ""));
  return path;
}

/// Returns when it has booted.
async function startSlave(bus, address, control) {
  const booted = new Promise((resolve) => bus.on("frame", ({ id }) => id === 0x742 && resolve()));
  const [host, port] = address.split(":");
  const qemu = ["-M", "mps2-an385", "-kernel", slave, "-display", "none", "-monitor", "none", "-serial", "null",
    "-serial", `tcp:${address},nodelay=on`];
  const pico = [join(import.meta.dirname, "slave.mjs"), slave, address, control];
  const child = slave.endsWith(".elf") ? spawn("qemu-system-arm", qemu)
    : slave.endsWith(".uf2") ? spawn(process.execPath, pico, { stdio: "inherit" }) : spawn(slave, [host, port]);
  running.add(child);
  await booted;
  return child;
}

/// Calls use(master) with a Device on a bus with the plant of devices.toml, that knows the nodes as SDO servers.
async function withPlant(use, ...options) {
  count();
  const place = vcan ? ["--can", `socketcan:${vcan}`] : ["--slcan", "127.0.0.1:0"];
  const folder = mkdtempSync(join(tmpdir(), "cbcan-plant-"));
  if (slave?.endsWith(".uf2")) options.push("--clock", "manual");
  const simulator = await startSimulator(program, "--config", plant(folder), "--control", "127.0.0.1:0", ...place, ...options);
  const bus = vcan ? await socketCanBus(vcan) : await slcanBus(simulator.where.slcan);
  const io = slave && (await startSlave(bus, simulator.where.slcan, simulator.where.control));
  const master = new Device({ id: 126, eds: new Eds() });
  try {
    for (const node of [IO, TRANSDUCER, DRIVE, GENERIC]) master.eds.addSdoClientParameter(node, 0x600 + node, 0x580 + node);
    bus.on("frame", (frame) => master.receive(frame));
    master.on("message", (frame) => bus.send(frame));
    await use(master, bus, simulator.where.control);
  } finally {
    master.stop();
    bus.close();
    io?.kill();
    running.delete(io);
    await simulator.stop();
    rmSync(folder, { recursive: true });
  }
}

const happens = async (emitter, event) => (await once(emitter, event, { signal: AbortSignal.timeout(LIMIT) }))[0];

const read = (master, deviceId, index, subIndex, dataType, options = {}) =>
  master.sdo.upload({ deviceId, index, subIndex, dataType, timeout: LIMIT, ...options });

const write = (master, deviceId, index, subIndex, data, dataType, options = {}) =>
  master.sdo.download({ deviceId, index, subIndex, data, dataType, timeout: LIMIT, ...options });

const refusal = (code) => (error) => error.code === code;

/// canopen does not support $NODEID: its user inserts the node ID.
function description(node) {
  const folder = mkdtempSync(join(tmpdir(), "cbcan-eds-"));
  try {
    const text = readFileSync(join(sources, "plants/demo", `${EDS[node]}.eds`), "latin1");
    const path = join(folder, "node.eds");
    writeFileSync(path, text.replace(/\$NODEID\+(0x[0-9A-F]+)/g, (_, base) => `0x${(Number(base) + node).toString(16)}`));
    return Eds.fromFile(path);
  } finally {
    rmSync(folder, { recursive: true });
  }
}

test("EDS files of the demo plant", () => {
  count();
  const io = description(IO);
  assert.equal(io.getDeviceName(), "cbcan I/O module");
  assert.deepEqual(io.getIdentity(), { vendorId: 0, productCode: 0x191, revisionNumber: 0x10000, serialNumber: 1 });
  assert.equal(io.getEmcyCobId(), 0xc2);
  assert.deepEqual(io.getReceivePdos().map((pdo) => [pdo.cobId, pdo.dataSize]), [[0x242, 1], [0x342, 4]]);
  assert.deepEqual(io.getTransmitPdos().map((pdo) => [pdo.cobId, pdo.dataSize]), [[0x1c2, 1], [0x2c2, 4]]);
  assert.deepEqual(description(DRIVE).getTransmitPdos().map((pdo) => [pdo.cobId, pdo.dataSize]), [[0x185, 2], [0x285, 3], [0x385, 6], [0x485, 6]]);
  assert.equal(description(TRANSDUCER).getTransmitPdos()[0].dataObjects[0].parameterName, "Pressure");
});

test("SDO: what a node is", () => withPlant(async (master) => {
  master.start();
  assert.equal(await read(master, IO, 0x1000, 0, DataType.UNSIGNED32), 0x000f0191);
  assert.equal(await read(master, DRIVE, 0x1018, 2, DataType.UNSIGNED32), 0x192);
  assert.equal(await read(master, TRANSDUCER, 0x9130, 1, DataType.INTEGER32), 99021);
  assert.equal(await read(master, IO, 0x1008, 0, DataType.VISIBLE_STRING), "cbcan I/O module");
  assert.equal(await read(master, DRIVE, 0x1009, 0, DataType.VISIBLE_STRING), "1.0");
}));

test("SDO: expedited there and back", () => withPlant(async (master) => {
  master.start();
  for (const [index, type, value] of [[0x2001, "UNSIGNED8", 0xa5], [0x2002, "UNSIGNED16", 0xbeef],
                                      [0x2003, "UNSIGNED24", 0x123456], [0x2004, "UNSIGNED32", 0xdeadbeef]]) {
    await write(master, GENERIC, index, 0, value, DataType[type]);
    assert.equal(await read(master, GENERIC, index, 0, DataType[type]), value);
  }
  await write(master, IO, 0x6411, 2, -300, DataType.INTEGER16);
  assert.equal(await read(master, IO, 0x6411, 2, DataType.INTEGER16), -300);
}));

const bytes = (size) => Buffer.from(Array.from({ length: size }, (_, i) => (i * 7 + 1) & 0xff));

test("SDO: segmented there and back", () => withPlant(async (master) => {
  master.start();
  for (const [index, size] of [[0x2005, 5], [0x2008, 8], [0x200e, 14], [0x207f, 127], [0x2080, 128], [0x2100, 1000]]) {
    await write(master, GENERIC, index, 0, bytes(size));
    assert.deepEqual(await read(master, GENERIC, index, 0), bytes(size));
  }
}));

test("SDO: block there and back", () => withPlant(async (master) => {
  master.start();
  const block = { blockTransfer: true, blockInterval: 0 };
  for (const [index, size] of [[0x2008, 8], [0x200e, 14], [0x2080, 128], [0x2100, 1000]]) {
    await write(master, GENERIC, index, 0, bytes(size), null, block);
    assert.deepEqual(await read(master, GENERIC, index, 0, null, block), bytes(size));
  }
  master.sdo.setBlockSize(3);
  assert.deepEqual(await read(master, GENERIC, 0x2100, 0, null, block), bytes(1000));
}));

// It answers an abort with an abort, which a server must ignore.
test("SDO: aborts", () => withPlant(async (master, bus) => {
  master.start();
  let responses = 0;
  bus.on("frame", ({ id }) => (responses += id === 0x580 + IO));
  await assert.rejects(read(master, IO, 0x5fff, 0), refusal(0x06020000));
  await assert.rejects(read(master, IO, 0x6401, 9), refusal(0x06090011));
  await assert.rejects(write(master, IO, 0x1000, 0, 1, DataType.UNSIGNED32), refusal(0x06010002));
  await assert.rejects(write(master, IO, 0x6200, 1, 1, DataType.UNSIGNED32), refusal(0x06070012));
  await assert.rejects(write(master, DRIVE, 0x6007, 0, 9, DataType.INTEGER16), refusal(0x06090031));
  await assert.rejects(read(master, GENERIC, 0x3333, 0, null, { blockTransfer: true }), refusal(0x06020000));
  assert.equal(await read(master, IO, 0x1000, 0, DataType.UNSIGNED32), 0x000f0191);
  assert.equal(responses, 5);
}));

test("NMT: boot-up and every state", () => withPlant(async (master) => {
  master.eds.addHeartbeatConsumer(IO, LIMIT);
  master.start();
  const state = async () => {
    const heartbeat = await happens(master.nmt, "heartbeat");
    assert.equal(heartbeat.deviceId, IO);
    return heartbeat.state;
  };
  let heard = state();
  master.nmt.resetNode(IO);
  assert.equal(await heard, NmtState.INITIALIZING);
  heard = state();
  await write(master, IO, 0x1017, 0, 10, DataType.UNSIGNED16);
  assert.equal(await heard, NmtState.PRE_OPERATIONAL);
  for (const [command, reached] of [["startNode", NmtState.OPERATIONAL], ["stopNode", NmtState.STOPPED],
                                    ["enterPreOperational", NmtState.PRE_OPERATIONAL],
                                    ["resetCommunication", NmtState.INITIALIZING]]) {
    heard = state();
    master.nmt[command](IO);
    assert.equal(await heard, reached);
  }
  assert.equal(await read(master, IO, 0x1017, 0, DataType.UNSIGNED16), 0);
}));

test("heartbeat that ends: EMCY 8130h", () => withPlant(async (master) => {
  master.eds.addEmcyConsumer(0xc2);
  master.start();
  await write(master, IO, 0x1016, 1, (126 << 16) | 100, DataType.UNSIGNED32);
  const heard = happens(master.emcy, "emergency");
  master.eds.setHeartbeatProducerTime(10);
  while ((await happens(master, "message")).id !== 0x77e);
  master.eds.setHeartbeatProducerTime(0);
  const { cobId, em } = await heard;
  assert.deepEqual([cobId, em.code, em.register & 0x11], [0xc2, 0x8130, 0x11]);
  assert.equal((await read(master, IO, 0x1003, 1, DataType.UNSIGNED32)) & 0xffff, 0x8130);
}));

test("EMCY: an RPDO that is too short, and over again", () => withPlant(async (master) => {
  master.eds.addEmcyConsumer(0xc2);
  master.start();
  master.nmt.startNode(IO);
  for (const [data, code] of [[[1, 2], 0x8210], [[1, 2, 3, 4], 0]]) {
    const heard = happens(master.emcy, "emergency");
    master.emit("message", { id: 0x342, data: Buffer.from(data) });
    assert.equal((await heard).em.code, code);
  }
  assert.equal(await read(master, IO, 0x1001, 0, DataType.UNSIGNED8), 0);
  assert.equal(await read(master, IO, 0x6411, 2, DataType.INTEGER16), 0x0403);
}));

function produceSync(master) {
  master.eds.setSyncCobId(0x80);
  master.eds.setSyncGenerationEnable(true);
}

test("PDO: TPDOs of all nodes are its RPDOs", () => withPlant(async (master) => {
  for (const node of [IO, TRANSDUCER]) master.mapRemoteNode({ id: node, eds: description(node), skipSdo: true });
  produceSync(master);
  master.start();
  master.nmt.startNode();
  const heard = new Map();
  const all = new Promise((resolve) => master.pdo.on("pdo", ({ cobId, dataObjects }) => {
    heard.set(cobId, dataObjects.map((object) => object.value));
    if (heard.size === 3) resolve();
  }));
  master.nmt.startNode(0);
  master.sync.write();  // the transducer's is synchronous
  await all;
  assert.deepEqual(heard, new Map([[0x1c2, [0x5a]], [0x2c2, [1234, -2]], [0x181, [99021]]]));
}));

test("PDO: its TPDO is a node's RPDO", () => withPlant(async (master) => {
  const output = master.eds.addEntry(0x2000, { parameterName: "Outputs", dataType: DataType.UNSIGNED8 });
  master.eds.addTransmitPdo({ cobId: 0x242, transmissionType: 254, dataObjects: [output] });
  master.start();
  master.nmt.startNode(0);
  output.value = 0xa5;
  assert.equal(await read(master, IO, 0x6200, 1, DataType.UNSIGNED8), 0xa5);
}));

test("SYNC: with counter, from a start value on", () => withPlant(async (master, bus) => {
  produceSync(master);
  master.start();
  await write(master, IO, 0x1019, 0, 4, DataType.UNSIGNED8);
  await write(master, IO, 0x1801, 1, 0x800002c2, DataType.UNSIGNED32);
  await write(master, IO, 0x1801, 2, 2, DataType.UNSIGNED8);
  await write(master, IO, 0x1801, 6, 3, DataType.UNSIGNED8);
  await write(master, IO, 0x1801, 1, 0x000002c2, DataType.UNSIGNED32);
  master.nmt.startNode(IO);
  const sent = [];
  bus.on("frame", ({ id, data }) => id === 0x2c2 && sent.push(data.toString("hex")));
  const after = [];
  for (const counter of [1, 2, 3, 4, 1, 2, 3]) {
    master.sync.write(counter);
    await read(master, IO, 0x1001, 0, DataType.UNSIGNED8);  // earlier frames come before this response
    after.push(sent.length);
  }
  assert.deepEqual([...new Set(sent)], ["d204feff"]);
  assert.deepEqual(after, [0, 0, 0, 1, 1, 2, 2]);
}));

/// The answers to lines at --control.
async function commands(control, ...lines) {
  const [host, port] = control.split(":");
  const client = createConnection({ host, port });
  client.end(lines.join("\n") + "\n");
  let answers = "";
  for await (const part of client) answers += part;
  return answers.trimEnd().split("\n");
}

test("TIME: the module is set by it, and produces it", () => withPlant(async (master, bus, control) => {
  master.eds.setTimeCobId(0x100);
  master.eds.setTimeProducerEnable(true);
  master.eds.setTimeConsumerEnable(true);
  master.start();
  assert.deepEqual(await commands(control, "trigger write 0 0x1012 0 4 0x100 0xC000"), ["ok"]);  // C000 0100h
  master.time.write(new Date("2030-05-17T12:00:00.000Z"));
  let answers;
  do answers = await commands(control, "trigger read 0 0x3008 0 6", "read 3706 3");
  while (!/^ok \d+ \d+ 16938$/.test(answers[1]));  // days since 1984-01-01
  const heard = happens(master.time, "time");
  // 14,400,500 ms after midnight of the next day
  await commands(control, `trigger write 0 0x3008 0 6 ${14_400_500 & 0xffff} ${14_400_500 >> 16} 16939`);
  assert.deepEqual(await heard, new Date("2030-05-18T04:00:00.500Z"));
}, "--set", "module.enabled=true"));

const IDENTITY = { vendorId: 0x2b, productCode: 0xc0ffee, revisionNumber: 0x10002, serialNumber: 0x80000001 };

/// The data of the next frame with this identifier.
const next = (bus, id) => new Promise((resolve, reject) => {
  AbortSignal.timeout(LIMIT).onabort = () => reject(new Error(`no frame ${id.toString(16)}`));
  bus.on("frame", (frame) => frame.id === id && resolve(frame.data));
});

// For fastscan, no response within a time is an answer. So time passes when another node has answered twice: its first response may have
// overtaken that of an LSS slave on the bus, the second request came after both.
test("LSS: fastscan, node ID, boot-up", () => withPlant(async (master, bus) => {
  const { setTimeout, clearTimeout } = globalThis;
  const waiting = new Set();
  let asked = 0, answered = 0, enough = 0;
  const ask = () => {
    ++asked;
    bus.send({ id: 0x600 + GENERIC, data: Buffer.from("4000100000000000", "hex") });
  };
  master.on("message", ({ id }) => {
    if (id !== 0x7e5) return;
    ask();
    enough = asked + 1;
  });
  bus.on("frame", ({ id }) => {
    if (id !== 0x580 + GENERIC || ++answered < asked) return;
    if (asked < enough) return ask();
    for (const expire of waiting) expire();
    waiting.clear();
  });
  const fastscan = () => {
    globalThis.setTimeout = (expire) => { waiting.add(expire); return expire; };
    globalThis.clearTimeout = (expire) => waiting.delete(expire);
    return master.lss.fastscan().finally(() => Object.assign(globalThis, { setTimeout, clearTimeout }));
  };
  master.eds.addSdoClientParameter(0x30, 0x630, 0x5b0);
  master.start();
  assert.deepEqual(await fastscan(), IDENTITY);
  await assert.rejects(master.lss.configureNodeId(128, LIMIT), refusal(1));
  await master.lss.configureNodeId(0x30, LIMIT);
  assert.equal(await master.lss.inquireVendorId(LIMIT), IDENTITY.vendorId);
  const bootUp = next(bus, 0x730);
  master.lss.switchModeGlobal(LssMode.OPERATION);
  assert.deepEqual(await bootUp, Buffer.from([0]));
  assert.equal(await read(master, 0x30, 0x1018, 4, DataType.UNSIGNED32), IDENTITY.serialNumber);
  assert.equal(await fastscan(), null);  // no node is without a node ID
}));

test("LSS: selected by its identity", () => withPlant(async (master, bus) => {
  master.start();
  await master.lss.switchModeSelective({ ...IDENTITY, timeout: LIMIT });
  assert.equal(await master.lss.inquireVendorId(LIMIT), IDENTITY.vendorId);
  assert.equal(await master.lss.inquireProductCode(LIMIT), IDENTITY.productCode);
  assert.equal(await master.lss.inquireRevisionNumber(LIMIT), IDENTITY.revisionNumber);
  assert.equal(await master.lss.inquireSerialNumber(LIMIT), IDENTITY.serialNumber);
  await master.lss.configureBitTiming(0, 2, LIMIT);
  await master.lss.configureNodeId(0x31, LIMIT);
  await master.lss.storeConfiguration(LIMIT);
  const bootUp = next(bus, 0x731);
  master.lss.switchModeGlobal(LssMode.OPERATION);
  assert.deepEqual(await bootUp, Buffer.from([0]));
}));

test("a drive under way: controlword by PDO, statusword by PDO", () => withPlant(async (master) => {
  const control = master.eds.addEntry(0x2000, { parameterName: "Controlword", dataType: DataType.UNSIGNED16 });
  master.eds.addTransmitPdo({ cobId: 0x205, transmissionType: 254, dataObjects: [control] });
  const status = master.eds.addEntry(0x2001, { parameterName: "Statusword", dataType: DataType.UNSIGNED16 });
  master.eds.addReceivePdo({ cobId: 0x185, dataObjects: [status] });
  master.start();
  master.nmt.startNode();
  const reaches = async (mask, state) => {
    while ((status.value & mask) !== state) await happens(master.pdo, "pdo");
  };
  master.nmt.startNode(DRIVE);
  await reaches(0x4f, 0x40);                 // switch on disabled
  for (const [command, state] of [[6, 0x21], [7, 0x23], [15, 0x27]]) {
    control.value = command;
    await reaches(0x6f, state);              // ready to switch on, switched on, operation enabled
  }
}));
