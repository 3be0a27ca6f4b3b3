// SPDX-License-Identifier: MIT
// The window through npm's modbus-serial, the client behind Node-RED's Modbus nodes.
// usage: node modbus_serial_test.mjs CBCAN_SIM
import assert from "node:assert/strict";
import test from "node:test";
import ModbusRTU from "modbus-serial";
import { LIMIT, count, startSimulator } from "./cases.mjs";

const program = process.argv[2];
const EXECUTE = 0xca0e, READ = 5055, WRITE = 5066;

async function withSimulator(use) {
  count();
  const simulator = await startSimulator(program, "--demo", "--modbus", "127.0.0.1:0");
  const client = new ModbusRTU();
  try {
    await client.connectTCP("127.0.0.1", { port: Number(simulator.where.modbus.split(":")[1]) });
    client.setID(1);
    client.setTimeout(LIMIT);
    await use(client);
  } finally {
    client.close(() => {});
    await simulator.stop();
  }
}

async function execute(client, ...words) {
  await client.writeRegisters(3700, [EXECUTE, ...words]);
  for (;;) {
    const { data } = await client.readHoldingRegisters(3700, 1);
    if (data[0] !== EXECUTE) return data[0];
  }
}

async function read(client, address, count) {
  return (await client.readHoldingRegisters(address, count)).data;
}

test("expedited there and back", () => withSimulator(async (client) => {
  assert.equal(await execute(client, WRITE, 0x42, 0x6411, 1, 2, 300), 0);
  assert.equal(await execute(client, READ, 0x42, 0x6411, 1, 2, 0), 0);
  assert.deepEqual(await read(client, 3705, 2), [2, 300]);
}));

test("128 bytes there and back", () => withSimulator(async (client) => {
  const words = Array.from({ length: 64 }, (_, i) => (i * 0x0301) & 0xffff);
  assert.equal(await execute(client, WRITE, 0x20, 0x2080, 0, 128, ...words), 0);
  assert.equal(await execute(client, READ, 0x20, 0x2080, 0, 128), 0);
  assert.deepEqual(await read(client, 3706, 64), words);
}));

test("single registers, execute last", () => withSimulator(async (client) => {
  for (const [address, word] of [[3701, READ], [3702, 0x20], [3703, 0x3333], [3704, 0], [3705, 4], [3700, EXECUTE]])
    await client.writeRegister(address, word);
  assert.deepEqual(await read(client, 3700, 1), [4]);
  assert.deepEqual(await read(client, 3706, 2), [0x0000, 0x0602]);
}));
