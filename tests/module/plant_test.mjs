// SPDX-License-Identifier: MIT
// The package as tests in JavaScript use it, and what the module promises.
// usage: node plant_test.mjs INSTALLED SOURCE_FOLDER NATIVE
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";
import { pathToFileURL } from "node:url";
import { count } from "./cases.mjs";

const [installed, source, native] = process.argv.slice(2);
const instances = [];
const Original = WebAssembly.Instance;
WebAssembly.Instance = class extends Original {
  constructor(...given) {
    super(...given);
    instances.push(this);
  }
};
const { Plant, PlantError, module } = await import(pathToFileURL(join(installed, "cbcan/index.mjs")));
const { Instance } = await import(pathToFileURL(join(installed, "cbcan/plant.mjs")));

const limits = readFileSync(join(source, "tests/limits.toml"), "utf8");
const mostOf = (name) => Number(limits.match(new RegExp(`^npm-${name} = ([\\d_]+)`, "m"))[1].replaceAll("_", ""));

const tarball = readdirSync(join(source, "build/module")).find((name) => /^cbcan-.*\.tgz$/.test(name));
const shipped = readdirSync(join(source, "scenarios")).filter((name) => name.endsWith(".toml")).length;
const EXECUTE = 0xca0e, READ = 5055;
const it = (name, run) => test(name, () => (count(), run()));

it("nothing is imported", () => assert.deepEqual(WebAssembly.Module.imports(module), []));

it("size", () => {
  const bytes = statSync(join(installed, "cbcan/cbcan.wasm")).size;
  console.log(`figure: the module has ${bytes} bytes`);
  assert.ok(bytes <= mostOf("module"), `${bytes} bytes`);
  const size = statSync(join(source, "build/module", tarball)).size;
  console.log(`figure: the tarball has ${size} bytes`);
  assert.ok(size <= mostOf("tarball"), `${size} bytes`);
});

it("what is in the tarball, with a README that says how to use it", () => {
  const files = execFileSync("tar", ["-tzf", join(source, "build/module", tarball)], { encoding: "utf8" }).trim().split("\n");
  const all = ["LICENSE", "README.md", "cbcan.mjs", "cbcan.wasm", "eds.mjs", "files.mjs", "index.d.mts", "index.mjs", "links.mjs", "network.mjs", "package.json", "plant.d.mts", "plant.mjs"];
  assert.deepEqual(files, ["", ...all].map((name) => `package/${name}`));
  const readme = readFileSync(join(installed, "cbcan/README.md"), "utf8");
  for (const page of [readme, readFileSync(join(source, "docs/how-to/test-in-ci.md"), "utf8")]) assert.ok(page.includes(`npm install ./${tarball}`));
  writeFileSync(join(installed, "../readme.mjs"), /```js\n([^]*?)```/.exec(readme)[1]);
  assert.match(execFileSync(process.execPath, [join(installed, "../readme.mjs")], { encoding: "utf8" }), /^\[ 401, 15 \] \[[^]*'5C2#4300100091010F00'\s*\]\n$/);
});

it("a transaction, its frames, and no time but what a test lets pass", async () => {
  const plant = await Plant.open();
  assert.deepEqual(plant.frames(), ["701#00", "702#00", "710#00", "720#00", "742#00", "77F#00"]);
  plant.write(3700, [EXECUTE, READ, 0x42, 0x1000, 0, 4]);
  assert.equal(plant.now, 0);
  assert.ok(plant.wait("register 3700 = 0"));
  assert.deepEqual(plant.registers(3700, 8), [0, READ, 0x42, 0x1000, 0, 4, 0x0191, 0xf]);
  assert.deepEqual(plant.frames(), ["642#4000100000000000", "5C2#4300100091010F00"]);
  assert.deepEqual(plant.frames(), []);
  plant.command("fault 0x42 response-never");
  plant.write(3700, [EXECUTE, READ, 0x42, 0x1000, 0, 4]);
  assert.equal(plant.wait("transaction ended", 0.5), false);
  assert.equal(plant.now, 0.5);
  assert.ok(plant.wait("transaction ended"));
  assert.equal(plant.now, 1);
  assert.ok(plant.holds("register 3700 = 4"));
  assert.deepEqual(plant.frames(), ["642#4000100000000000", "642#8000100000000405"]);
  assert.equal(plant.wait("emcy 5", "2s"), false);
  plant.advance("500ms");
  assert.equal(plant.now, 3.5);
  assert.throws(() => plant.wait("emcy 5", "2 hours"), PlantError);
});

it("two networks, and plants beside each other", async () => {
  const files = { "/plant.toml": '[[node]]\nid = 5\neds = "/io.eds"\n[[network]]\n[[network.node]]\nid = 5\neds = "/io.eds"\n',
    "/io.eds": readFileSync(join(source, "plants/demo/io_module.eds"), "utf8") };
  const one = await Plant.open({ args: ["--config", "/plant.toml"], files });
  const other = await Plant.open({ args: ["--config", "/plant.toml"], files });
  one.write(3700, [EXECUTE, READ, 5, 0x1000, 0, 4], 2);
  assert.ok(one.wait("register 2/3700 = 0"));
  assert.deepEqual(one.registers(3700, 2, 2), [0, READ]);
  assert.deepEqual(one.frames().slice(-2), ["2/605#4000100000000000", "2/585#4300100091010F00"]);
  assert.deepEqual(other.registers(3700, 2, 2), [0, 0]);
});

it("what is refused, in the words of cbcan-sim", async () => {
  await assert.rejects(Plant.open({ args: ["--config", "no.toml"] }), { name: "Error", message: /no\.toml/ });
  await assert.rejects(Plant.open({ args: ["--demo", "--pcap", "x"] }), PlantError);
  await assert.rejects(Plant.open({ args: ["--config", "p"], files: { p: "[[node]]\nid = 300\n" } }), { message: /p:2: node\.id 300: must be 1\.\.127/ });
  const plant = await Plant.open();
  await assert.rejects(Plant.open({ args: ["--demo\ud800"] }), { message: /--demo\ufffd: no such option/ });
  assert.throws(() => plant.command("nmt x \ud800"), PlantError);
  assert.throws(() => plant.wait("nonsense"), PlantError);
  assert.throws(() => plant.write(3700, [65536]), PlantError);
  assert.throws(() => plant.registers(0, 126), PlantError);
  assert.equal(plant.command("time"), "0.000000");
});

it("a trap is the end of its instance alone", async () => {
  const [one, other] = [new Instance(module), new Instance(module)];
  assert.throws(() => one.receive(99, new Uint8Array(1)), { message: "the plant has crashed and cannot go on: an exception" });
  assert.throws(() => one.call("told"), (error) => error === one.crash && error instanceof PlantError);
  assert.deepEqual(other.call("told"), []);
});

it("a day, with memory that does not grow", async () => {
  const plant = await Plant.open();
  const size = () => instances.at(-1).exports.memory.buffer.byteLength;
  plant.advance(3600);
  const before = size();
  plant.advance(86400 - 3600);
  assert.equal(plant.now, 86400);
  assert.equal(size(), before);
  const seconds = (program) => {
    const options = "--demo --set node.16.heartbeat_ms=10 --modbus :0 --clock manual";
    const script = `echo "pass 86400s" | "${program}" ${options} >/dev/null 2>&1; times`;
    const [, minutes, rest] = /^(\d+)m([\d.]+)s/.exec(execFileSync("bash", ["-c", script], { encoding: "utf8" }).split("\n")[1]);
    return 60 * minutes + Number(rest);
  };
  const [here, natively] = [seconds(join(installed, ".bin/cbcan-sim")), seconds(native)];
  console.log(`figure: a day with a heartbeat each 10 ms takes ${here.toFixed(2)} s, natively ${natively.toFixed(2)} s; ${before} bytes of memory`);
});

it("many plants, one after the other", async () => {
  for (let i = 0; i < 50; ++i) assert.equal((await Plant.open()).command("nodes").split("\n").length, 5);
});

it("Node.js 18 and the newest", () => {
  for (const name of ["oldest", "newest"]) {
    const node = join(installed, name, "bin/node");
    const version = execFileSync(node, ["--version"], { encoding: "utf8" });
    const run = (...args) => execFileSync(node, [join(installed, "cbcan/cbcan.mjs"), ...args], { encoding: "utf8", cwd: source });
    assert.ok(run("run", "scenarios").endsWith(`\n${shipped} passed\n`), version);
    const script = 'const { Plant } = await import(process.argv[1]); console.log((await Plant.open()).now)';
    assert.equal(execFileSync(node, ["--input-type=module", "-e", script, pathToFileURL(join(installed, "cbcan/index.mjs")).href], { encoding: "utf8" }), "0\n");
    console.log(`figure: the package runs on Node.js ${version.trim()}`);
  }
});

it("the example of docs/how-to/test-in-ci.md", () => {
  const page = readFileSync(join(source, "docs/how-to/test-in-ci.md"), "utf8");
  assert.ok(readFileSync(join(source, "examples/javascript/plant.test.mjs"), "utf8").includes(/```js\n([^]*?)```/.exec(page)[1]));
  const copy = join(installed, "../plant.test.mjs");
  copyFileSync(join(source, "examples/javascript/plant.test.mjs"), copy);
  assert.match(execFileSync(process.execPath, ["--test", copy], { encoding: "utf8" }), /^# pass 1$/m);
});

it("types", () => {
  const folder = mkdtempSync(join(tmpdir(), "types-"));
  const used = `import { Plant, type PlantOptions } from "${join(installed, "cbcan/index.mjs")}";
const options: PlantOptions = { args: ["--demo"], files: { a: "b" } };
const plant: Plant = await Plant.open(options);
plant.write(3700, [1], 1);
const words: number[] = plant.registers(3700, 2);
const held: boolean = plant.wait("x", 1) && plant.holds("y") && plant.now === 0;
export const all = [words, held, plant.frames() satisfies string[]];
`;
  const check = (text) => {
    writeFileSync(join(folder, "test.mts"), text);
    const options = ["--noEmit", "--strict", "--target", "es2022", "--module", "nodenext", join(folder, "test.mts")];
    return spawnSync(process.execPath, [join(installed, "typescript/bin/tsc"), ...options], { encoding: "utf8" }).stdout;
  };
  try {
    assert.equal(check(used), "");
    assert.match(check(used + 'plant.write("3700", 1);\n'), /^\S+test\.mts\(8,13\): error TS2345/);
    assert.match(check(used + "plant.now = 1;\n"), /error TS2540/);
  } finally {
    rmSync(folder, { recursive: true });
  }
});
