// SPDX-License-Identifier: MIT
/**
 * A simulated CANopen plant behind a coprocessor's registers, for tests in JavaScript, in Node.js and in a browser. In Node.js import
 * this package, which loads the module by itself; elsewhere its "plant.mjs". The plant's time passes only by advance(), wait() and the
 * commands `pass` and `wait`, so each run is the same. Nothing reads a clock, opens a file or a socket. Several plants at once are
 * independent of each other. Everything but open() is done when it returns.
 */

/** A command, a plant file or an option was refused; the text is cbcan-sim's. After "the plant has crashed" open another. */
export class PlantError extends Error {}

export interface PlantOptions {
  /** Options of cbcan-sim, as separate words; default: ["--demo"]. */
  args?: string[];
  /** Files by the path that an option or a plant file gives them. */
  files?: Record<string, string | Uint8Array>;
  /** The content of another file, null if there is none; default: none, in Node.js the file of this machine. */
  read?: (path: string) => string | Uint8Array | null | Promise<string | Uint8Array | null>;
}

export class Plant {
  /** Opens a plant. `module`: cbcan.wasm, compiled. Throws PlantError with the messages about a wrong plant file or option. */
  static open(options: PlantOptions & { module: WebAssembly.Module }): Promise<Plant>;

  /** Executes a line of docs/reference/commands.md and returns its response without "ok" or "at". Throws PlantError. */
  command(line: string): string;

  /** Writes registers in one request, as the PLC does. Words are 0..65535. `unit`: the network, 1..8. */
  write(first: number, words: number[], unit?: number): void;

  /** Reads registers as the PLC does, 1..125 of them. */
  registers(first: number, count: number, unit?: number): number[];

  /** Seconds since the start of the plant. */
  readonly now: number;

  /** Lets time pass: a number of seconds, or a duration as commands have it, "500ms". */
  advance(time: number | string): void;

  /**
   * Lets time pass until a condition of docs/reference/commands.md holds, or for `within` (60 seconds), given as for advance().
   * false: it did not hold in time. Throws PlantError when the condition is not understood.
   */
  wait(condition: string, within?: number | string): boolean;

  /** Whether a condition holds now. */
  holds(condition: string): boolean;

  /** The frames since the start or the last call, in candump's format: "605#4017100000000000"; on network 2 "2/605#...". */
  frames(): string[];
}

/** One plant or one run of scenarios for a program that has files, connections and a clock; hostsim/module/instance.hpp is its manual. */
export class Instance {
  constructor(module: WebAssembly.Module);
  /** Set after a trap; every further call throws it. */
  readonly crash?: PlantError;
  start(args: string[], host: Host & { folder?: string }): Promise<Record<string, any>>;
  play(place: number, host: Host): Promise<{ log: [string, string][] }>;
  call(name: string, given?: object): any;
  pass(now: number): number;
  receive(connection: number, bytes: Uint8Array): void;
  endInput(connection: number): void;
  sent(connection: number): Iterable<Uint8Array>;
  state(connection: number): { wantsMore: boolean; isBusy: boolean; hasEnded: boolean };
  disconnect(connection: number): void;
}

/** The time for Instance.pass(), from 0 on. When the machine has slept, time goes on where it was, and `slept` is called. */
export class Clock {
  constructor(slept?: (seconds: number) => void);
  now(): number;
}

export interface Host {
  read: NonNullable<PlantOptions["read"]>;
  /** The paths of the files *.toml in a folder and below it, null if there is no such folder. */
  list?: (path: string) => string[] | null | Promise<string[] | null>;
}
