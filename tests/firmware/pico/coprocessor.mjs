// SPDX-License-Identifier: MIT
// The coprocessor on a Raspberry Pi Pico with a stopped clock, for a program: each line of standard input is an order, answered by a line.
// usage: node coprocessor.mjs IMAGE.uf2...
import { createInterface } from "node:readline";
import { Pico, flashFrom, frame, text } from "./rig.mjs";

const images = process.argv.slice(2).map(flashFrom);
const STATES = [0, 0x80, 0x10, 0x20];  // of EFLG
let pico;

const orders = {
  /// A board with the image of this number, that has booted.
  start(number) {
    pico = new Pico(images[number].slice(), { stopped: true });
    pico.run(1_000_000, () => pico.sent.length > 0);
    pico.settle();
    pico.sent = [];
  },
  sent: () => (pico.sent.length ? text(pico.sent.shift()) : ""),
  can(received) {
    pico.can.receive(frame(received));
    pico.settle();
  },
  pass: (us) => pico.run(Number(us)),
  state(number) {
    pico.can.hold(STATES[number]);
    pico.settle();
  },
  modbus(request) {
    pico.modbus = [];
    for (const byte of Buffer.from(request, "hex")) {
      pico.rp2040.uart[0].feedByte(byte);
      pico.settle();
    }
    return Buffer.from(pico.modbus).toString("hex");
  },
};

for await (const line of createInterface({ input: process.stdin })) {
  const [order, argument] = line.split(" ");
  console.log(orders[order](argument) ?? "");
}
