// SPDX-License-Identifier: MIT
// Imports a flow into Node-RED, presses its buttons one after the other, and prints what its debug node shows.
// usage: node node_red.mjs FLOW.json EMPTY_FOLDER
import RED from "node-red";

const [flowFile, userDir] = process.argv.slice(2);
const settings = { flowFile, userDir, httpAdminRoot: false, httpNodeRoot: false, telemetry: { enabled: false } };
RED.init({ ...settings, logging: { console: { level: "error" } } });

let show;
RED.hooks.add("onReceive", ({ destination, msg }) => {
  if (destination.node.type === "debug") show(msg.payload);
});

const started = new Promise((resolve) => RED.runtime.events.once("flows:started", resolve));
await RED.start();
await started;
const ids = (wanted) => {
  const found = [];
  RED.nodes.eachNode(({ id, type }) => type === wanted && found.push(id));
  return found;
};
await new Promise((resolve) => RED.nodes.getNode(ids("modbus-client")[0]).once("mbconnected", resolve));
for (const id of ids("inject")) {
  const shown = new Promise((resolve) => { show = resolve; });
  RED.nodes.getNode(id).receive();
  console.log(await shown);
}
await RED.stop();
process.exit();
