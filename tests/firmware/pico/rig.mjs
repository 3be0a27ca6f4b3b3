// SPDX-License-Identifier: MIT
// A Raspberry Pi Pico with an MCP2515 in rp2040js, with a flash memory that can be written. Time is that of the processor: 8 ns for
// each cycle, never the wall clock.
import { readFileSync } from "node:fs";
import { BasePeripheral, ConsoleLogger, LogLevel, RP2040, GPIOPinState } from "rp2040js";
import { Mcp2515 } from "./mcp2515.mjs";

const NS_PER_CYCLE = 8, FLASH = 0x10000000, RAM = 0x20000000, SECOND_STAGE = 0x20041f00;
const MISO_OF = 17, INT = 20;  // the MCP2515's select pin and its INT

export class PowerCut extends Error {}

/// A flash memory of 2 MB with sectors of 4 KB, as W25Q16JV's data sheet describes it: programming ANDs, and wraps in its page of 256
/// bytes. Operations are counted; that with the number cut.at is interrupted: cut.how is "before", "half" or "after".
class NorFlash {
  constructor(bytes) {
    Object.assign(this, { bytes, operations: 0, cut: {}, busy: 0, writable: false, command: [] });
  }

  transfer(byte) {
    this.command.push(byte);
    return this.command[0] === 0x05 && this.busy-- > 0 ? 1 : 0;
  }

  /// The select pin has been raised.
  end() {
    const [command, ...rest] = this.command.splice(0);
    if (command === 0x06) this.writable = true;
    if (command !== 0x02 && command !== 0x20) return;
    if (!this.writable || this.busy > 0) throw new Error(`flash: command ${command} without write enable, or while busy`);
    const address = (rest[0] << 16) | (rest[1] << 8) | rest[2], data = rest.slice(3);
    this.operate(command === 0x20 ? this.erasure(address) : this.programming(address, data));
    this.writable = false;
    this.busy = 3;
  }

  erasure(address) {
    const sector = address & ~4095;
    return (part) => this.bytes.fill(0xff, sector, sector + 4096 * part);
  }

  programming(address, data) {
    const page = address & ~255;
    return (part) => data.forEach((byte, i) => (this.bytes[page | ((address + i) & 255)] &= part < 1 ? byte | 0x5a : byte));
  }

  operate(act) {
    const cut = this.operations++ === this.cut.at ? this.cut.how : undefined;
    if (cut === "half") act(0.5);
    else if (cut !== "before") act(1);
    if (cut) throw new PowerCut();
  }
}

/// The interface to the flash (RP2040 data sheet, 4.10): as memory, or commands byte by byte while the pin's override selects it.
class Ssi extends BasePeripheral {
  constructor(rp2040, flash) {
    super(rp2040, "SSI");
    Object.assign(this, { flash, registers: {}, override: 0 });
  }

  get readable() {
    const { registers, override } = this;
    return override === 0 && registers[0x08] === 1 && registers[0x00] === 0x001f0300 && registers[0x04] === 0 && registers[0x10] === 1 &&
      registers[0x14] >= 4 && registers[0xf4] === 0x03000218;
  }

  readUint32(offset) {
    return offset === 0x28 ? 0xe : offset === 0x60 ? this.received : this.registers[offset] ?? 0;
  }

  writeUint32(offset, value) {
    this.registers[offset] = value;
    if (offset !== 0x60) return;
    if (this.registers[0x00] !== 7 << 16 || this.override !== 2) throw new Error("SSI: a byte for a flash that is not selected");
    this.received = this.flash.transfer(value);
  }
}

class SelectPin extends BasePeripheral {
  writeUint32(offset, value) {
    if (offset !== 0x0c) throw new Error(`IO_QSPI: ${offset}`);
    if (value >> 8 === 3) this.ssi.flash.end();
    this.ssi.override = value >> 8;
  }
}

function crc32(bytes) {
  let value = 0xffffffff;
  for (const byte of bytes)
    for (let bit = 7; bit >= 0; --bit) value = (value << 1) ^ (((value >>> 31) ^ (byte >> bit)) & 1 ? 0x04c11db7 : 0);
  return value >>> 0;
}

/// The content of a flash memory after the file was copied to the drive of the boot ROM.
export function flashFrom(file) {
  const uf2 = readFileSync(file), flash = new Uint8Array(2 * 1024 * 1024).fill(0xff);
  for (let at = 0; at < uf2.length; at += 512) {
    const [start, second, flags, address, size, number, count, family] = new Uint32Array(uf2.buffer.slice(uf2.byteOffset + at, uf2.byteOffset + at + 32));
    if (start !== 0x0a324655 || second !== 0x9e5d5157 || flags !== 0x2000 || family !== 0xe48bff56 || size !== 256 ||
        number !== at / 512 || count !== uf2.length / 512 || uf2.readUint32LE(at + 508) !== 0x0ab16f30)
      throw new Error(`${file}: block ${at / 512} is not UF2 for the RP2040`);
    flash.set(uf2.subarray(at + 32, at + 32 + size), address - FLASH);
  }
  return flash;
}

export const text = ({ id, data, remote }) =>
  `${id.toString(16).toUpperCase().padStart(3, "0")}#${remote ? `R${data.length}` : Buffer.from(data).toString("hex").toUpperCase()}`;

export function frame(text) {
  const [id, data] = text.split("#"), remote = data[0] === "R";
  const bytes = remote ? new Uint8Array(Number(data[1] ?? 0)) : Buffer.from(data, "hex");
  return { id: parseInt(id, 16), data: bytes, remote, extended: id.length === 8 };
}

export class Pico {
  /// `flash`: from flashFrom(), and changed by the program. `stopped`: instructions take no time; only run() makes it pass.
  constructor(flash, { stopped = false } = {}) {
    const rp2040 = (this.rp2040 = new RP2040());
    rp2040.logger = new ConsoleLogger(LogLevel.Error);
    this.core = rp2040.core;
    this.clock = rp2040.clock;
    this.nsPerCycle = stopped ? 0 : NS_PER_CYCLE;
    this.sent = [];
    this.modbus = [];
    this.boot(flash);
    this.can = new Mcp2515(this.clock, (level) => rp2040.gpio[INT].setInputValue(level), (frame) => this.onSent(frame));
    this.can.takes_time = !stopped;
    rp2040.spi[0].onTransmit = (byte) => rp2040.spi[0].completeTransmit(this.can.transfer(byte));
    rp2040.gpio[MISO_OF].addListener((state) => this.can.select(state === GPIOPinState.Low));
    rp2040.uart[0].onByte = (byte) => this.modbus.push(byte);
    rp2040.peripherals[0x40058].onWatchdogTrigger = () => {
      throw new Error("the watchdog has reset the board");
    };
  }

  onSent(frame) {
    this.sent.push(frame);
  }

  /// As the boot ROM does (data sheet, 2.8.1.3).
  boot(flash) {
    const { rp2040, core } = this;
    this.flash = new NorFlash(flash);
    this.ssi = rp2040.peripherals[0x18000] = new Ssi(rp2040, this.flash);
    rp2040.peripherals[0x40018] = Object.assign(new SelectPin(rp2040, "IO_QSPI"), { ssi: this.ssi });
    rp2040.flash.fill(0xff);
    rp2040.flash = flash;
    rp2040.flashView = new DataView(flash.buffer, flash.byteOffset);
    if (crc32(flash.subarray(0, 252)) !== rp2040.flashView.getUint32(252, true)) throw new Error("CRC of the second stage");
    rp2040.sram.set(flash.subarray(0, 256), SECOND_STAGE - RAM);
    core.PC = SECOND_STAGE;
  }

  get us() {
    return Math.floor(this.clock.nanos / 1000);
  }

  /// Executes up to the next sleep; at most until `end`, in ns. False: it sleeps.
  step(end) {
    const { core, clock, ssi, nsPerCycle } = this;
    while (clock.nanos < end) {
      if (core.waiting) {
        if (!ssi.readable) throw new Error("SSI: the flash cannot be read");
        if (!(core.pendingInterrupts & core.enabledInterrupts)) return false;
        core.waiting = !core.checkForInterrupts();
      }
      if (core.PC >>> 24 === FLASH >>> 24) throw new Error("the program runs in flash");
      clock.tick(core.executeInstruction() * nsPerCycle);
    }
    return true;
  }

  /// Lets time pass; `until`() true ends it earlier.
  run(us, until = () => false) {
    const { clock } = this, end = clock.nanos + us * 1000;
    while (clock.nanos < end && !until()) {
      if (this.nsPerCycle === 0) this.settle();
      else if (this.step(end)) continue;
      const next = clock.nextAlarm ? clock.nanosToNextAlarm : Infinity;
      clock.tick(Math.min(Math.max(next, 0), end - clock.nanos));
    }
    if (this.nsPerCycle === 0) this.settle();
  }

  /// Executes until it sleeps; no time passes on a stopped clock.
  settle() {
    while (this.step(Infinity) || (this.clock.nextAlarm && this.clock.nanosToNextAlarm <= 0)) this.clock.tick(0);
  }
}
