// SPDX-License-Identifier: MIT
// The slave of examples/slave on a Raspberry Pi Pico: the test is the other nodes and the supply.
// The driver's counters are registers of the coprocessor's image.
// usage: node slave_test.mjs SLAVE.uf2 COPROCESSOR.uf2
import assert from "node:assert/strict";
import test from "node:test";
import { count } from "./cases.mjs";
import { Pico, PowerCut, flashFrom, frame, text } from "./rig.mjs";

const [image, coprocessor] = process.argv.slice(2).map(flashFrom);

/// A board that has booted.
function start(flash = image.slice()) {
  const pico = new Pico(flash);
  pico.run(20_000);
  return pico;
}

/// The frames sent within `us` after a frame was received; none was received if it is undefined.
function send(pico, received, us = 3000) {
  pico.sent = [];
  if (received) pico.can.receive(frame(received));
  pico.run(us);
  return pico.sent.map(text);
}

function check(name, steps) {
  test(name, () => {
    count();
    steps();
  });
}

const SAVE = "642#2310100173617665", HEARTBEAT = "642#4017100000000000";
const heartbeat = (ms) => `642#2B171000${Buffer.from([ms & 255, ms >> 8]).toString("hex").toUpperCase()}0000`;
const DONE = (object) => [`5C2#60${object}00000000`];
const RECOVERED = ["0C2#4081110000000000", "0C2#0000000000000000"];  // from bus-off, and no error
const show = (ms) => [`5C2#4B171000${Buffer.from([ms & 255, ms >> 8]).toString("hex").toUpperCase()}0000`];

check("boot-up, SDO, aborts and segments", () => {
  const pico = start();
  assert.deepEqual(pico.sent.map(text), ["742#00"]);
  assert.deepEqual(send(pico, "642#4000100000000000"), ["5C2#4300100091010F00"]);
  assert.deepEqual(send(pico, "642#40FF5F0000000000"), ["5C2#80FF5F0000000206"]);
  assert.deepEqual(send(pico, "642#4008100000000000"), ["5C2#4108100010000000"]);
  assert.deepEqual(send(pico, "642#6000000000000000"), ["5C2#00636263616E2049"]);
  assert.deepEqual(send(pico, "643#4000100000000000"), []);
});

check("NMT, PDOs, RTR, SYNC and heartbeat", () => {
  const pico = start();
  assert.deepEqual(send(pico, "000#0142").sort(), ["1C2#5A", "2C2#D204FEFF"]);
  assert.deepEqual(send(pico, "242#A5"), []);
  assert.deepEqual(send(pico, "642#4000620100000000"), ["5C2#4F006201A5000000"]);
  assert.deepEqual(send(pico, "1C2#R1"), ["1C2#5A"]);
  assert.deepEqual(send(pico, "742#R1"), ["742#05"]);
  send(pico, heartbeat(10));
  assert.equal(send(pico, undefined, 1_000_000).filter((each) => each === "742#05").length, 100);
  assert.deepEqual(send(pico, "000#8142", 5000), ["742#00"]);
});

check("LSS: a new address is stored, and applies after the power was off", () => {
  const pico = start();
  assert.deepEqual(send(pico, "7E5#0401000000000000"), []);
  assert.deepEqual(send(pico, "7E5#1105000000000000"), ["7E4#1100000000000000"]);
  for (const [bit_rate, stored] of [["00", "02"], ["02", "00"]]) {  // the crystal gives no 1 Mbit/s
    assert.deepEqual(send(pico, `7E5#1300${bit_rate}0000000000`), ["7E4#1300000000000000"]);
    assert.deepEqual(send(pico, "7E5#1700000000000000", 50_000), [`7E4#17${stored}000000000000`]);
  }
  assert.deepEqual(start(pico.flash.bytes).sent.map(text), ["705#00"]);
});

check("both receive buffers: requests back to back are answered in order", () => {
  const pico = start();
  pico.sent = [];
  for (let i = 0; i < 300; ++i) {
    for (const object of ["0010", "0A10"]) pico.can.receive(frame(`642#40${object}0000000000`)), pico.run(240);
    pico.run(600);
  }
  assert.equal(pico.sent.length, 600);
  pico.sent.forEach((each, i) => assert.equal(text(each).slice(6, 10), i % 2 ? "0A10" : "0010"));
});

check("parameters are stored, and restored", () => {
  let pico = start();
  send(pico, heartbeat(500));
  assert.deepEqual(send(pico, SAVE, 50_000), DONE("101001"));
  pico = start(pico.flash.bytes);
  assert.deepEqual(send(pico, HEARTBEAT), show(500));
  assert.deepEqual(send(pico, "642#231110016C6F6164", 50_000), DONE("111001"));
  assert.deepEqual(send(start(pico.flash.bytes), HEARTBEAT), show(0));
});

check("a power cut at each step of the first start, and of storing, leaves the old values or the new ones", () => {
  const first = start().flash;
  for (let at = 0; at < first.operations; ++at)
    for (const how of ["before", "half", "after"]) {
      const pico = new Pico(image.slice());
      pico.flash.cut = { at, how };
      assert.throws(() => pico.run(20_000), PowerCut);
      assert.deepEqual(start(pico.flash.bytes).sent.map(text), ["742#00"]);
    }
  const before = start(first.bytes);
  send(before, heartbeat(500));
  send(before, SAVE, 50_000);
  let steps = 0;
  for (let at = 0, done = false; !done; ++at)
    for (const how of ["before", "half", "after"]) {
      let pico = start(before.flash.bytes.slice());
      send(pico, heartbeat(600));
      pico.flash.cut = { at: pico.flash.operations + at, how };
      try {
        done = send(pico, SAVE, 50_000).length === 1;
      } catch (error) {
        assert.ok(error instanceof PowerCut);
        ++steps;
      }
      pico = start(pico.flash.bytes);
      const [value] = send(pico, HEARTBEAT);
      assert.ok(value === show(600)[0] || (!done && value === show(500)[0]), `${at} ${how}: ${value}`);
      send(pico, heartbeat(700));
      send(pico, SAVE, 50_000);
      assert.deepEqual(send(start(pico.flash.bytes), HEARTBEAT), show(700));
    }
  assert.ok(steps >= 15, `${steps} steps`);
});

check("frames are read in order, while one arrives with each that is read", () => {
  const pico = start();
  pico.can.next = [3, 4, 5, 6, 7].map((n) => frame(`08${n}#`));
  for (const received of ["081#", "082#"]) pico.can.receive(frame(received));
  pico.run(3000);
  assert.deepEqual([pico.can.next, pico.can.order], [[], []]);
});

check("frames are read in order, when two arrive before the next is read", () => {
  const pico = start();
  pico.can.later = [frame("082#"), frame("083#")];
  pico.can.receive(frame("642#4000100000000000"));  // takes longer than a status of the controller
  pico.run(3000);
  assert.deepEqual([pico.can.later, pico.can.order], [[], []]);
});

check("identifiers of 11 bits pass, those of 29 bits do not; a DLC of 15 means 8", () => {
  const pico = start(), request = frame("642#4000100000000000");
  for (const id of [0x000, 0x080, 0x5ff, 0x77f, 0x7ff]) {
    pico.can.receive({ ...request, id });
    assert.equal(pico.can.order.length, 1);
    pico.run(3000);
  }
  assert.deepEqual(send(pico, "18D00642#4000100000000000"), []);
  pico.can.receive({ ...request, dlc: 15 });
  assert.deepEqual(send(pico), ["5C2#4300100091010F00"]);
});

check("an overflow is shown for a second, error passive as long as it lasts", () => {
  const pico = start();
  for (const overflow of [() => ["081#", "082#", "083#"].forEach((each) => pico.can.receive(frame(each))), () => pico.can.fault(0x40)]) {
    overflow();
    assert.deepEqual(send(pico), ["0C2#1081110000000000"]);
    assert.deepEqual(send(pico, undefined, 990_000), []);
    assert.deepEqual(send(pico, undefined, 10_000), [RECOVERED[1]]);
  }
  pico.can.fault(0x08);
  assert.deepEqual(send(pico), ["0C2#2081110000000000"]);
  pico.can.set(0x2d, 0, 0x08);
  assert.deepEqual(send(pico), [RECOVERED[1]]);
});

check("bus-off ends by itself, without frames from before", () => {
  const pico = start();
  pico.can.goBusOff(false);
  assert.deepEqual(send(pico, "642#4000100000000000", 100_000), []);
  pico.can.goBusOff(true);
  assert.deepEqual(send(pico, undefined, 100_000), RECOVERED);
  assert.deepEqual(send(pico, "642#4000100000000000"), ["5C2#4300100091010F00"]);
});

check("a frame without acknowledgement is given up after a second", () => {
  const pico = start();
  pico.can.acknowledged = false;
  send(pico, "642#4000100000000000", 1_100_000);
  pico.can.acknowledged = true;
  assert.deepEqual(send(pico, undefined, 100_000), ["0C2#2081110000000000", RECOVERED[1]]);  // error passive
});

check("a frame that is on the bus when it is given up is sent, and not lost", () => {
  const pico = start();
  pico.can.acknowledged = false;
  send(pico, "642#4000100000000000", 500_000);
  pico.can.keeps_frame = true;
  pico.run(1_000_000);
  pico.can.acknowledged = true;
  assert.deepEqual(send(pico), ["5C2#4300100091010F00", "0C2#2081110000000000", RECOVERED[1]]);
});

for (const fault of ["starts", "joins"])
  check(`a controller that never ${fault} is configured again until it does`, () => {
    const pico = new Pico(image.slice());
    pico.can[fault] = false;
    pico.run(500_000);
    pico.can[fault] = true;
    assert.deepEqual(send(pico, undefined, 300_000), ["742#00"]);
  });

check("a brown-out of the controller is noticed, and it is configured again", () => {
  const pico = start();
  pico.can.brownOut();
  assert.deepEqual(send(pico, undefined, 1_100_000), RECOVERED);
  assert.deepEqual(send(pico, "642#4000100000000000"), ["5C2#4300100091010F00"]);
});

check("frames, losses and errors are counted", () => {
  const pico = start(coprocessor.slice());
  /// What has been received, sent and lost, and errors, in R4116, R4118, R4122 and R4124: how many more after this.
  const more = (act) => {
    const counted = () => {
      pico.modbus = [];
      Buffer.from("01031014000a8109", "hex").forEach((byte) => (pico.rp2040.uart[0].feedByte(byte), pico.run(100)));
      pico.run(50_000);
      return [3, 7, 15, 19].map((at) => (pico.modbus[at] << 8) | pico.modbus[at + 1]);
    };
    const before = counted();
    act();
    pico.run(1_200_000);
    return counted().map((count, i) => count - before[i]);
  };
  assert.deepEqual(more(() => ["081#", "082#", "083#"].forEach((each) => pico.can.receive(frame(each)))), [2, 2, 1, 0]);  // sent: overflow and its end
  assert.deepEqual(more(() => pico.can.set(0x2c, 0x80)), [0, 0, 0, 1]);  // MERRF
  assert.deepEqual(more(() => pico.can.brownOut()), [0, 2, 0, 1]);
  const unanswered = () => {
    pico.can.acknowledged = false;
    pico.can.receive(frame("67F#4000100000000000"));
  };
  assert.deepEqual(more(unanswered), [1, 2, 1, 0]);
});

for (const line of [0x00, 0xff])
  check(`an adapter that does not answer: the line gives ${line}`, () => {
    const pico = new Pico(image.slice());
    pico.can.dead = line;
    pico.run(500_000);
    pico.can.dead = undefined;
    assert.deepEqual(send(pico, undefined, 300_000), ["742#00"]);
    pico.can.dead = line;
    send(pico, undefined, 1_100_000);  // it looks once a second
    pico.can.dead = undefined;
    assert.deepEqual(send(pico, undefined, 300_000), RECOVERED);
    assert.deepEqual(send(pico, "642#4000100000000000"), ["5C2#4300100091010F00"]);
  });
