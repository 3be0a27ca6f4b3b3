// SPDX-License-Identifier: MIT
// A Raspberry Pi Pico on the bus of a cbcan-sim with a manual clock, which follows the processor's: each of its milliseconds passes there
// too, not faster than real time.
// usage: node slave.mjs SLAVE.uf2 SLCAN_HOST:PORT CONTROL_HOST:PORT
import { once } from "node:events";
import { connect } from "node:net";
import { setTimeout } from "node:timers/promises";
import { slcanBus } from "./can_bus.mjs";
import { Pico, flashFrom } from "./rig.mjs";

const [file, slcan, control] = process.argv.slice(2), [host, port] = control.split(":");
const pico = new Pico(flashFrom(file));
const bus = await slcanBus(slcan);
const clock = connect({ host, port: Number(port), noDelay: true });
await once(clock, "connect");
pico.onSent = bus.send;
const received = [];
bus.on("frame", (frame) => received.push(frame));
for (const begin = performance.now(); ; ) {
  if (received.length) pico.can.receive(received.shift());
  pico.run(received.length ? 250 : 1000);
  clock.write(`pass ${received.length ? 250 : 1000}us\n`);
  await once(clock, "data");
  await setTimeout(Math.max(0, pico.us / 1000 - (performance.now() - begin)));
}
