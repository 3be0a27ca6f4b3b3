// SPDX-License-Identifier: MIT
// The MCP2515 as Microchip's DS20001801 describes it, at the SPI bus of an emulated processor. Frames are
// { id, data, remote, extended }.

const CONFIGURATION = 0x80, CANINTE = 0x2b, CANINTF = 0x2c, EFLG = 0x2d, TXREQ = 8, BUS_OFF = 0x20;
const NS_PER_BIT = 2000;  // 500 kbit/s

export class Mcp2515 {
  /// `clock`: of rp2040js. setInterrupt(level): the INT pin. send(frame): an acknowledged frame.
  constructor(clock, setInterrupt, send) {
    Object.assign(this, { clock, setInterrupt, send, registers: new Uint8Array(128), dead: undefined, starts: true, joins: true, acknowledged: true,
                          keeps_frame: false, next: [], later: [], order: [], held: 0, takes_time: true });
    this.registers.fill(0xa5);  // unknown after power-on
    this.end_of_frame = clock.createAlarm(() => this.finish());
    this.end_of_bus_off = clock.createAlarm(() => this.set(EFLG, 0, BUS_OFF));
    this.reset();
  }

  reset() {
    for (const address of [CANINTE, CANINTF, EFLG, 0x30, 0x60, 0x70]) this.registers[address] = 0;
    this.registers.fill(0, 0x20, 0x28);
    this.registers[0x0e] = this.starts ? CONFIGURATION : 0;
    this.order = [];
    this.update();
  }

  /// The supply has failed for a moment.
  brownOut() {
    this.registers.fill(0xa5);
    this.reset();
  }

  set(address, set, clear = 0) {
    this.registers[address] = (this.registers[address] & ~clear) | set;
    this.update();
  }

  update() {
    this.setInterrupt(!(this.registers[CANINTE] & this.registers[CANINTF]));
  }

  select(selected) {
    const buffer = { 0x90: 1, 0x94: 2 }[selected ? undefined : this.bytes?.[0]];
    this.bytes = [];
    if (selected && this.clock.nanos - this.released > 5000) this.later.splice(0).forEach((frame) => this.receive(frame));
    if (!buffer) return;
    this.released = this.clock.nanos;
    if (this.order.shift() !== buffer) throw new Error("MCP2515: frames are read in another order");
    this.set(CANINTF, 0, buffer);
    if (this.next.length) this.receive(this.next.shift());  // at this moment
  }

  /// One byte each way.
  transfer(byte) {
    if (this.dead !== undefined) return this.dead;
    const count = this.bytes.push(byte), [command, address] = this.bytes;
    const { registers } = this;
    if (command === 0xc0) this.reset();
    if (command === 0x81) this.request();
    if (command === 0x02 && count > 2) this.write(address + count - 3, byte);
    if (command === 0x05 && count === 4) this.write(address, (registers[address] & ~this.bytes[2]) | (byte & this.bytes[2]));
    if (command === 0x40 && registers[0x30] & TXREQ) throw new Error("MCP2515: TXB0 is written while it is sent");
    if (command === 0x40 && count > 1) registers[0x2f + count] = byte;
    if (command === 0x03 && count > 2) return registers[address + count - 3];
    if (command === 0xa0 && count > 1) return (registers[CANINTF] & 3) | ((registers[0x30] & TXREQ) >> 1);
    if (command === 0x90 && count > 1) return registers[0x5f + count];
    if (command === 0x94 && count > 1) return registers[0x6f + count];
    return 0;
  }

  write(address, value) {
    const settings = address < 0x0c || (address >= 0x10 && address < 0x2b);
    if (settings && this.registers[0x0e] !== CONFIGURATION) throw new Error("MCP2515: only in configuration mode");
    if (address === 0x30 && this.keeps_frame) return;
    this.registers[address] = value;
    if (address === EFLG) this.registers[EFLG] |= this.held;
    if (address === 0x0f && this.joins) this.registers[0x0e] = value & 0xe0;
    if (this.registers[EFLG] & 0xc0) this.registers[CANINTF] |= 0x20;  // an overflow keeps its interrupt
    this.update();
  }

  request() {
    this.registers[0x30] |= TXREQ;
    const bits = 47 + 8 * (this.registers[0x35] & 15);
    this.end_of_frame.schedule(this.takes_time ? bits * NS_PER_BIT : 0);
  }

  finish() {
    const { registers } = this;
    if (!(registers[0x30] & TXREQ) || registers[EFLG] & BUS_OFF) return;
    if (!this.acknowledged) {
      this.set(EFLG, 0x10);  // error passive, and again
      return this.end_of_frame.schedule(1e6);
    }
    registers[0x30] &= ~TXREQ;
    const remote = (registers[0x35] & 0x40) !== 0, length = registers[0x35] & 15;
    this.set(EFLG, this.held, 0x10);
    this.send({ id: (registers[0x31] << 3) | (registers[0x32] >> 5), data: registers.slice(0x36, 0x36 + length), remote });
  }

  /// RXF0 and RXF1, with RXM0, for 11 bits (4.5).
  passes(id, extended) {
    const word = (at) => (this.registers[at] << 3) | (this.registers[at + 1] >> 5);
    return [0x00, 0x04].some((filter) => extended === ((this.registers[filter + 1] & 8) !== 0) && ((word(filter) ^ id) & word(0x20)) === 0);
  }

  /// A frame of another node.
  receive({ id, data, remote, extended = false, dlc = data.length }) {
    const { registers } = this;
    if (registers[0x0e] !== 0 || registers[EFLG] & BUS_OFF || !this.passes(id, extended)) return;
    const second = registers[CANINTF] & 1, rolls_over = registers[0x60] & 4;
    if (second && (!rolls_over || registers[CANINTF] & 2)) return this.fault(rolls_over ? 0x80 : 0x40);
    registers.set([id >> 3, ((id & 7) << 5) | (remote ? 0x10 : 0), 0, 0, dlc, ...data], second ? 0x71 : 0x61);
    this.order.push(second ? 2 : 1);
    this.set(CANINTF, second ? 2 : 1);
  }

  /// Sets bits of EFLG.
  fault(errors) {
    this.registers[CANINTF] |= 0x20;
    this.set(EFLG, errors);
  }

  /// These bits of EFLG are set until the next call, but those of an overflow can be cleared.
  hold(errors) {
    this.held = errors & 0x3f;
    this.registers[CANINTF] |= 0x20;
    this.set(EFLG, errors, 0xff);
  }

  /// Bus-off; ends after 128 times 11 bits if the bus is good.
  goBusOff(good) {
    this.fault(BUS_OFF);
    if (good) this.end_of_bus_off.schedule(128 * 11 * NS_PER_BIT);
  }
}
