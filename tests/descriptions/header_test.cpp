// SPDX-License-Identifier: MIT
// What cbcan-network prints for plants/demo/network.toml, in a program.
#include "cbcan/canopen/manager/network_objects.hpp"
#include "network.hpp"
#include "support/catch.hpp"

TEST_CASE("the header is a network in constant memory") {
  cbcan::NetworkObjects objects;
  REQUIRE(objects.use(kNetwork));
  CHECK(objects.number(0x1F80, 0) == 0x01);           // NMT manager; it starts the nodes
  CHECK(objects.number(0x1F81, 0x42) == 0x05);        // a slave, to be booted
  CHECK(objects.number(0x1F81, 0x20) == 0);           // not in the file
  CHECK(objects.number(0x1F84, 0x42) == 0x000F0191);  // [1000] of io_module.eds
  CHECK(objects.write(0x1F81, 0x42, {}) == cbcan::AbortCode::kReadOnly);
}
