// SPDX-License-Identifier: MIT
// Writes object 2004h of node 20h of `cbcan-sim --demo`, reads it, its name, and an object that does not exist: modbus-serial.
import ModbusRTU from "modbus-serial";

const plc = new ModbusRTU();
await plc.connectTCP("127.0.0.1", { port: 1502 });
plc.setID(1);

// One SDO transfer; data and the result are byte strings as on CAN, low byte first.
async function transact(command, node, index, sub, size, data = Buffer.alloc(0)) {
  const words = [];
  for (let i = 0; i < data.length; i += 2) words.push(data[i] | data[i + 1] << 8);
  await plc.writeRegisters(3700, [0xca0e, command, node, index, sub, size, ...words]);
  let window;
  do window = await plc.readHoldingRegisters(3700, 70);
  while (window.data[0] === 0xca0e);
  const [result, , , , , bytes, low, high] = window.data;
  const hex = (word) => word.toString(16).toUpperCase().padStart(4, "0");
  if (result === 4) throw new Error(`abort ${hex(high)} ${hex(low)}h`);
  if (result !== 0) throw new Error(`refused: R3700 = ${result}`);
  return window.buffer.swap16().subarray(12, 12 + bytes);  // high byte first
}

const read = (node, index, sub) => transact(5055, node, index, sub, 128);
const write = (node, index, sub, data) => transact(5066, node, index, sub, data.length, data);

const number = Buffer.alloc(4);
number.writeUInt32LE(123456789);
await write(0x20, 0x2004, 0, number);
console.log("2004h =", (await read(0x20, 0x2004, 0)).readUInt32LE());
console.log("1008h =", (await read(0x20, 0x1008, 0)).toString("latin1"));
await read(0x20, 0x3333, 0).catch((error) => console.log("3333h:", error.message));
plc.close(() => {});
