// SPDX-License-Identifier: MIT
// node --test: tests against the demo plant, in virtual time. Install the npm package first: docs/how-to/install.md.
import assert from "node:assert/strict";
import test from "node:test";
import { Plant } from "@owner/cbcan";

test("a silent node costs a second of the plant's time", async () => {
  const plant = await Plant.open({ args: ["--demo"] });
  plant.command("power 0x42 off");
  plant.write(3700, [0xca0e, 5055, 0x42, 0x6411, 1, 2]);
  assert.ok(plant.wait("register 3700 = 4", "2s"));
  assert.equal(plant.now, 1);
  assert.deepEqual(plant.frames().slice(-2), ["642#4011640100000000", "642#8011640100000405"]);
});
