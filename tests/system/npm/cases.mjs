// SPDX-License-Identifier: MIT
// As support/cases.py and support/simulator.py do.
import { spawn } from "node:child_process";
import { once } from "node:events";
import { createInterface } from "node:readline";

/// Milliseconds, for actions that take few of them on an idle machine.
export const LIMIT = 60_000;

let ran = 0;
export const count = () => ++ran;

/// Child processes, killed at the end.
export const running = new Set();
process.on("exit", () => {
  for (const simulator of running) simulator.kill();  // however the test has ended
  console.log(`${ran} cases ran`);
  if (ran === 0) process.exitCode = 1;
});

/// A running cbcan-sim: `where` it serves, as its ready line says ({ modbus: "127.0.0.1:1502", ... }), and stop().
export async function startSimulator(program, ...options) {
  const simulator = spawn(program, options, { stdio: ["pipe", "pipe", "inherit"] });
  running.add(simulator);
  const ended = once(simulator, "exit");
  const [ready] = await once(createInterface({ input: simulator.stdout }), "line", { signal: AbortSignal.timeout(LIMIT) });
  const where = Object.fromEntries(ready.split(" ").slice(1).map((part) => part.split("=")));
  const stop = async () => {
    simulator.kill("SIGTERM");
    await ended;
    running.delete(simulator);
  };
  return { where, stop };
}
