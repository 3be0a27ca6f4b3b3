#!/usr/bin/env node
// SPDX-License-Identifier: MIT
process.argv.splice(2, 0, "cbcan-network");
await import("./cbcan.mjs");
