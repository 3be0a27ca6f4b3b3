// SPDX-License-Identifier: MIT
// Networks whose time does not begin at 0, as with the real clock.
#include "plant/demo.hpp"
#include "support/bare_network.hpp"

namespace cbcan::plant::test {

TEST_CASE("a wire takes no samples of the time before the networks have started: that would never end") {
  constexpr Time kStart = Time{100 * 86400} * kSecond;
  const base::FileReader read = config::with_demo_plant(no_file);
  config::Config config;
  REQUIRE(config::read_plant(R"(
[module]
enabled = false
[[node]]
id = 32
eds = "demo:/generic.eds"
signals = [ { index = 0x2002, shape = "ramp", to = 1000, duration_ms = 1000, sample_ms = 10 } ]
[[node]]
id = 33
eds = "demo:/generic.eds"
[[wire]]
from = "32:0x2002"
to = "33:0x2002"
sample_ms = 1
)",
                             "late.toml", config)
              .empty());
  config::PlantBuild build = config::build_nodes(config, read);
  REQUIRE(build.good);
  cbcan::test::ByHand driver;
  driver.now = kStart;
  Network network(config, config.networks[0], std::move(build.networks[0]), driver.context());
  Wires wires(config, config.wires, {&network}, driver.context());
  network.start(false);
  const auto at = [&](Time time) {
    driver.now = time;
    network.advance();
    return network.world().nodes()[1]->number({0x2002, 0, {}, false}).value_or(-1);
  };
  CHECK(at(kStart) == 0);
  CHECK(at(kStart + 10 * kMillisecond) == 10);
}

}  // namespace cbcan::plant::test
