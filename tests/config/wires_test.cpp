// SPDX-License-Identifier: MIT
// Wires in a plant file, and messages about them.
#include "config/wires.hpp"

#include <fmt/core.h>

#include "plant_support.hpp"
#include "support/catch.hpp"

using namespace cbcan::config;
using namespace cbcan::config;
using namespace cbcan::config::test;

namespace {

constexpr std::string_view kNode = "[[node]]\nid = 5\neds = \"a.eds\"\n";

}  // namespace

TEST_CASE("ten thousand wires in a row, and the loop that they form, are checked once") {
  Config config = read(kNode).config;
  constexpr unsigned kWires = 20'000;
  for (unsigned i = 0; i < kWires; ++i) {
    WireConfig wire;
    wire.from = *parse_wire_end(fmt::format("5:{}", 0x2000 + i));
    wire.to = *parse_wire_end(fmt::format("5:{}", 0x2000 + i + 1));
    config.wires.push_back(wire);
  }
  CHECK(check(config).empty());
  config.wires.back().to = config.wires[0].from;
  const Lines lines = to_lines(check(config));
  CHECK(lines.size() == kWires);
  CHECK(
      lines.back().ends_with("goes round in a loop without delay; give one of its wires delay_ms or lag_ms"));
}

TEST_CASE("an impossible end of a wire is reported once") {
  const std::string text = std::string(kNode) + "[[wire]]\nfrom = \"5:outpt:1\"\nto = \"5:0x2001\"\n";
  CHECK(read(text).errors.size() == 1);
  CHECK(check(read(text).config).empty());
}

TEST_CASE("wires") {
  const auto with = [](const std::string& wire) {
    const Plant plant = read(std::string(kNode) + "[[wire]]\n" + wire + "\n");
    Lines found = plant.errors;
    if (found.empty()) found = to_lines(check(plant.config));
    return found.empty() ? std::string() : found.front();
  };
  const std::string ends = "from = \"5:0x2001\"\nto = \"5:0x2002\"\n";
  CHECK(with(ends) == "");
  CHECK(with("to = \"5:0x2002\"") == "plant.toml:4: wire.from: is missing; add from = \"66:output:1\"");
  CHECK(
      with("from = \"5:output:0\"\nto = \"5:0x2002\"") ==
      "plant.toml:5: wire.from \"5:output:0\": must be NODE:INDEX:SUB, with .BIT appended for one bit, or "
      "NODE:output:N, NODE:analogue-output:N, NODE:input:N or NODE:analogue-input:N; 2/NODE is on network 2");
  CHECK(with(ends + "delay_ms = -1") == "plant.toml:7: wire.delay_ms -1: must be 0..3600000 ms");
  CHECK(with(ends + "lagg_ms = 1") == "plant.toml:7: wire.lagg_ms: no such key; did you mean wire.lag_ms?");
  CHECK(with("frm = \"5:0x2001\"\nto = \"5:0x2002\"") ==
        "plant.toml:5: wire.frm: no such key; did you mean wire.from?");
  CHECK(with("from = \"2/5:0x2001\"\nto = \"5:0x2002\"") ==
        "plant.toml:4: wire 2/5:0x2001 to 5:0x2002: 2/5:0x2001: there is no such node in the plant");
  CHECK(with(ends + "low = 2\nhigh = 1") ==
        "plant.toml:4: wire 5:0x2001 to 5:0x2002: low is above high; exchange them");
  CHECK(with(ends + "[[wire]]\nfrom = \"5:output:1\"\nto = \"#1:0x2002.3\"") ==
        "plant.toml:7: wire 5:output:1 to #1:0x2002.3: #1:0x2002.3 already has a wire at plant.toml:4; "
        "remove one of the two, or write sum = true in both");
  const std::string loop = ends + "[[wire]]\nfrom = \"5:0x2002\"\nto = \"5:0x2001\"\n";
  CHECK(with(loop) ==
        "plant.toml:4: wire 5:0x2001 to 5:0x2002: goes round in a loop without delay; give one of its wires "
        "delay_ms or lag_ms");
  CHECK(with(loop + "lag_ms = 1") == "");
  CHECK(with(loop + "block = \"ramp up=1\"") == "");
  CHECK(with(loop + "block = \"hysteresis\"")
            .starts_with("plant.toml:4: wire 5:0x2001 to 5:0x2002: goes round"));
  CHECK(with(ends + "block = \"pt1 time=x\"") ==
        "plant.toml:7: wire.block \"pt1 time=x\": block pt1: time: must be 0.000001..1e9");
  CHECK(with(ends + "lag_ms = 1\nblock = \"pt1\"") ==
        "plant.toml:4: wire 5:0x2001 to 5:0x2002: has lag_ms and block; remove one of the two");
  const std::string sum = ends + "sum = true\n[[wire]]\nfrom = \"5:0x2003\"\nto = \"5:0x2002\"\nsum = true\n";
  CHECK(with(sum) == "");
  CHECK(with(sum + "[[wire]]\nfrom = \"5:0x2002\"\nto = \"5:0x2003\"\n")
            .starts_with("plant.toml:8: wire 5:0x2003 to 5:0x2002: goes round"));
  CHECK(with(sum + "[[wire]]\nfrom = \"5:0x2003\"\nto = \"5:0x2002.1\"\nsum = true\n")
            .ends_with("5:0x2002.1 already has a wire at plant.toml:4; remove one of the two, or write sum = "
                       "true in both"));
  CHECK(read("wire = 5\n").errors == Lines{"plant.toml:1: wire: must be a list; write wire = [{ from = "
                                           "\"66:output:1\", to = \"5:0x2001\" }]"});
}
