// SPDX-License-Identifier: MIT
// Mistakes in plant files and their messages; most of them: mistakes.txt.
#include <fmt/core.h>

#include "config/build_node.hpp"
#include "plant_support.hpp"
#include "support/case_file.hpp"

using namespace cbcan::config::test;
using namespace cbcan::test;

namespace {

constexpr std::string_view kNode = "[[node]]\nid = 5\neds = \"a.eds\"\n";

Lines errors_in(std::string_view text) {
  return read(text).errors;
}

/// Mistakes in a plant file; if there are none, those that only the whole configuration shows.
Lines mistakes_in(std::string_view text) {
  const Plant plant = read(text);
  return plant.errors.empty() ? to_lines(check(plant.config)) : plant.errors;
}

}  // namespace

TEST_CASE("each mistake of the table has its message") {
  for (const FileCase& each : cases_of("tests/config/mistakes.txt")) {
    std::string text = each.text();
    if (text.starts_with("@node\n")) text.replace(0, 6, kNode);
    each.check(without("plant.toml:", mistakes_in(text)));
  }
}

TEST_CASE("a drive's axis") {
  const Plant good =
      read(std::string(kNode) + "axis = { positive_limit = 4e5, inertia_kgcm2 = 12.5, gravity_mnm = -3 }\n");
  CHECK(good.errors.empty());
  const auto& axes = good.config.networks.at(0).nodes.at(0).axes;
  REQUIRE(axes.size() == 1);
  CHECK(axes[0].positive_limit == 400'000);
  CHECK(axes[0].load == cbcan::devices::AxisLoad{12.5, 0, -3});
  const auto several = read(std::string(kNode) + "axis = { home_low = 7, 3.home_low = 9 }\n");
  CHECK(several.errors.empty());
  REQUIRE(several.config.networks.at(0).nodes.at(0).axes.size() == 3);
  CHECK(several.config.networks.at(0).nodes.at(0).axes[0].home_low == 7);
  CHECK(several.config.networks.at(0).nodes.at(0).axes[1] == cbcan::devices::AxisLayout{});
  CHECK(several.config.networks.at(0).nodes.at(0).axes[2].home_low == 9);
}

TEST_CASE("a file with more than 100 errors is not read further") {
  std::string text = "[can]\n";
  for (int i = 0; i < 100; ++i)
    text += "key" + std::to_string(i) + " = 1\n";
  CHECK(errors_in(text).size() == 100);
  const Lines errors = errors_in(text + "one = 1\nmore = 1\n[modbus]\nkey = 1\n");
  CHECK(errors.size() == 101);
  CHECK(errors.back() ==
        "plant.toml: 100 mistakes, and the rest of the file has not been checked; correct these first");
}

TEST_CASE("a file in another encoding") {
  const auto refused = [](std::size_t line) {
    return Lines{"plant.toml:" + std::to_string(line) + ": this line is not UTF-8; save the file as UTF-8"};
  };
  CHECK(errors_in("[log]\n# caf\xE9\n") == refused(2));
  CHECK(errors_in("# \x80\n") == refused(1));
  CHECK(errors_in("\n\n# \xE2\x82") == refused(3));
  CHECK(errors_in("# caf\xC3\xA9 \xE2\x82\xAC \xF0\x9F\x9A\xB0\n") == Lines{});
}

TEST_CASE("a text without quotes") {
  CHECK(contains(errors_in("[can]\nspec = virtual\n").at(0), "write texts in double quotes"));
}

TEST_CASE("as many networks as there are unit IDs") {
  std::string text;
  for (int i = 2; i <= 247; ++i)
    text += "[[network]]\n";
  CHECK(mistakes_in(text) == Lines{});
  CHECK(mistakes_in(text + "[[network]]\n") ==
        Lines{"plant.toml:247: network 248: there can be 247 at most, as many as Modbus has unit IDs"});
}

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
