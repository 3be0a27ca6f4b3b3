// SPDX-License-Identifier: MIT
// Transactions one after the other, and several at once, by modbus-serial.
// usage: node modbus_test.mjs CBCAN_SIM
import assert from "node:assert/strict";
import test from "node:test";
import ModbusRTU from "modbus-serial";
import { LIMIT, count, startSimulator } from "./cases.mjs";

const EXECUTE = 0xca0e, READ = 5055, WRITE = 5066;

async function client(address) {
  const modbus = new ModbusRTU();
  await modbus.connectTCP("127.0.0.1", { port: Number(address.split(":")[1]) });
  modbus.setTimeout(LIMIT);
  modbus.setID(1);
  return modbus;
}

test("10,000 transactions", async () => {
  count();
  const simulator = await startSimulator(process.argv[2], "--demo", "--modbus", "127.0.0.1:0");
  const [plc, other] = [await client(simulator.where.modbus), await client(simulator.where.modbus)];
  const execute = async (...words) => {
    await plc.writeRegisters(3700, [EXECUTE, ...words]);
    for (;;) {
      const { data } = await plc.readHoldingRegisters(3700, 8);
      if (data[0] !== EXECUTE) return data;
    }
  };
  const begin = performance.now();
  for (let i = 0; i < 5000; ++i) {
    const value = (i * 7) % 1000;
    assert.deepEqual(await execute(WRITE, 0x42, 0x6411, 1, 2, value), [0, WRITE, 0x42, 0x6411, 1, 2, value, 0]);
    const [data] = await Promise.all([execute(READ, 0x42, 0x6411, 1, 2), other.readHoldingRegisters(3700, 70)]);
    assert.deepEqual(data, [0, READ, 0x42, 0x6411, 1, 2, value, 0]);
  }
  console.log(`figure: ${(10_000_000 / (performance.now() - begin)).toFixed(0)} transactions a second by modbus-serial`);
  plc.close();
  other.close();
  await simulator.stop();
});
