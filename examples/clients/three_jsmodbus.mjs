// SPDX-License-Identifier: MIT
// Writes object 2004h of node 20h of `cbcan-sim --demo`, reads it, its name, and an object that does not exist: jsmodbus.
import net from "node:net";
import { once } from "node:events";
import modbus from "jsmodbus";

const socket = net.connect(1502, "127.0.0.1");
const plc = new modbus.client.TCP(socket, 1);
await once(socket, "connect");

// One SDO transfer; data and the result are byte strings as on CAN, low byte first.
async function transact(command, node, index, sub, size, data = Buffer.alloc(0)) {
  const words = [];
  for (let i = 0; i < data.length; i += 2) words.push(data[i] | data[i + 1] << 8);
  await plc.writeMultipleRegisters(3700, [0xca0e, command, node, index, sub, size, ...words]);
  let values;
  do {
    const { response } = await plc.readHoldingRegisters(3700, 70);
    values = response.body.valuesAsBuffer;  // high byte first
  } while (values.readUInt16BE() === 0xca0e);
  values.swap16();
  const hex = (offset) => values.readUInt16LE(offset).toString(16).toUpperCase().padStart(4, "0");
  const result = values.readUInt16LE();
  if (result === 4) throw new Error(`abort ${hex(14)} ${hex(12)}h`);
  if (result !== 0) throw new Error(`refused: R3700 = ${result}`);
  return values.subarray(12, 12 + values.readUInt16LE(10));
}

const read = (node, index, sub) => transact(5055, node, index, sub, 128);
const write = (node, index, sub, data) => transact(5066, node, index, sub, data.length, data);

const number = Buffer.alloc(4);
number.writeUInt32LE(123456789);
await write(0x20, 0x2004, 0, number);
console.log("2004h =", (await read(0x20, 0x2004, 0)).readUInt32LE());
console.log("1008h =", (await read(0x20, 0x1008, 0)).toString("latin1"));
await read(0x20, 0x3333, 0).catch((error) => console.log("3333h:", error.message));
socket.end();
