// SPDX-License-Identifier: MIT
// The README's session by npx, as docs/how-to/install.md shows it, on any system with Node.js; then the shipped scenarios.
// usage: node session_test.mjs FOLDER_OF_THE_TARBALL      CBCAN_SIM: a command instead of npx
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";
import { fileURLToPath } from "node:url";
import { count } from "../system/npm/cases.mjs";

const root = fileURLToPath(new URL("../../", import.meta.url));
const page = (name) => readFileSync(join(root, name), "utf8").replaceAll("\r", "");
const tarball = readdirSync(process.argv[2]).find((name) => /^cbcan-.*\.tgz$/.test(name));

/// What a user types at the place of the tarball; the shell finds npx on every system.
function type(options, input = "") {
  writeFileSync(join(folder, "in"), input);
  const program = process.env.CBCAN_SIM ?? `npx --yes ./${tarball}`;
  const { status } = spawnSync(`${program} ${options} <in >out 2>err`, { shell: true, cwd: folder });
  const [out, err] = ["out", "err"].map((name) => readFileSync(join(folder, name), "utf8").replaceAll("\r", ""));
  assert.equal(status, 0, out + err);
  return out;
}

const folder = mkdtempSync(join(tmpdir(), "cbcan-"));
copyFileSync(join(process.argv[2], tarball), join(folder, tarball));
test.after(() => rmSync(folder, { recursive: true }));

test("the README's session", () => {
  count();
  const [, used, options, session] = /^\$ npx \.\/(\S+) (.*--clock manual.*)\n([^]*?)^```/m.exec(page("docs/how-to/install.md"));
  assert.equal(used, tarball);
  const isResponse = /^(ready|ok|at)\b/;
  const typed = session.split("\n").filter((line) => line !== "" && !isResponse.test(line));
  const answered = session.split("\n").filter((line) => isResponse.test(line));
  assert.equal(type(options, typed.join("\n") + "\n").trim(), answered.join("\n"));
  const readme = /tail -n 11\n([^]*?)```/.exec(page("README.md"))[1].trim().split("\n");
  const frames = readFileSync(join(folder, "bus.log"), "utf8").trim().split("\n").map((line) => line.split(" ")[2]);
  assert.deepEqual(frames.slice(-11), readme);
});

test("the shipped scenarios", () => {
  count();
  const shipped = readdirSync(join(root, "scenarios")).filter((name) => name.endsWith(".toml")).length;
  assert.match(type(`run "${process.env.CBCAN_SCENARIOS ?? join(root, "scenarios")}"`), new RegExp(`^${shipped} passed$`, "m"));
});
