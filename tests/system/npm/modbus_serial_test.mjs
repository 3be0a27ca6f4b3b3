// SPDX-License-Identifier: MIT
// Requests of npm's modbus-serial that arrive in two pieces, cut at every byte.
// usage: node modbus_serial_test.mjs CBCAN_SIM
import assert from "node:assert/strict";
import { once } from "node:events";
import { connect, createServer } from "node:net";
import test from "node:test";
import ModbusRTU from "modbus-serial";
import { count, startSimulator } from "./cases.mjs";

async function client(port) {
  const modbus = new ModbusRTU();
  await modbus.connectTCP("127.0.0.1", { port });
  modbus.setID(1);
  return modbus;
}

test("a request in two pieces is one request", async () => {
  count();
  const simulator = await startSimulator(process.argv[2], "--demo", "--modbus", "127.0.0.1:0");
  const port = Number(simulator.where.modbus.split(":")[1]);
  const other = await client(port);
  let cut;
  const knife = createServer((near) => {
    const far = connect({ host: "127.0.0.1", port, noDelay: true });
    far.pipe(near);
    near.on("data", async (request) => {
      far.write(request.subarray(0, cut));
      await other.readHoldingRegisters(0, 1);  // so the first piece has been read
      far.write(request.subarray(cut));
    });
  });
  await once(knife.listen(0, "127.0.0.1"), "listening");
  const plc = await client(knife.address().port);
  for (cut = 1; cut < 17; ++cut) {  // before the last byte of the longer one: 13 bytes and two registers
    await plc.writeRegisters(100, [cut, ~cut & 0xffff]);
    assert.deepEqual((await plc.readHoldingRegisters(99, 3)).data, [0, cut, ~cut & 0xffff]);
  }
  for (const modbus of [plc, other]) modbus.close(() => {});
  knife.close();
  await simulator.stop();
});
