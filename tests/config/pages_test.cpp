// SPDX-License-Identifier: MIT
// --help and docs/reference/plant-file.md match the code.

#include "config/plant_settings.hpp"
#include "devices/devices.hpp"
#include "plant_support.hpp"
#include "support/case_file.hpp"

using namespace cbcan::config::test;
using namespace cbcan::test;

namespace {

/// The text of one option in --help, its lines joined; empty if there is none.
std::string help_on(std::string_view option) {
  std::string found;
  for (const std::string& line : lines_of(help_text())) {
    const bool starts = line.starts_with("  ") && line[2] == '-';
    const bool continues = line.starts_with("     ");
    if (!found.empty() && !continues) break;
    if (found.empty() && !(starts && contains(line + " ", std::string(option) + " "))) continue;
    found += line.substr(line.find_first_not_of(' ')) + " ";
  }
  return found;
}

/// With one blank between words.
std::string words_only(const std::string& text) {
  std::string joined;
  for (const std::string_view word : cbcan::base::words_of(text))
    joined += std::string(word) + " ";
  return joined;
}

/// The options in a text: words that begin with "--".
std::set<std::string> options_in(const std::string& text) {
  constexpr const char* kLetters = "abcdefghijklmnopqrstuvwxyz-";
  std::set<std::string> found;
  for (auto at = text.find("--"); at != std::string::npos; at = text.find("--", at + 2)) {
    const std::string word = text.substr(at, text.find_first_not_of(kLetters, at) - at);
    if (word.size() > 2 && word[2] != '-') found.insert(word);
  }
  return found;
}

std::set<std::string> known_options() {
  std::set<std::string> known;
  for (const std::string_view option : all_options())
    known.emplace(cbcan::base::option_name(option));
  return known;
}

Lines toml_snippets(const std::string& document) {
  const std::string opening = "```toml\n";
  Lines found;
  for (auto at = document.find(opening); at != std::string::npos; at = document.find(opening, at)) {
    at += opening.size();
    found.push_back(document.substr(at, document.find("```", at) - at));
  }
  return found;
}

}  // namespace

TEST_CASE("--help has every option with what it may be and its default, and every key for --set") {
  const std::string keys = help_text().substr(help_text().find("\nKeys of a plant file"));
  for_each_setting([&](const auto& row) {
    INFO(row.key);
    CHECK(contains(words_only(keys), " " + std::string(cbcan::base::leaf_of(row.key)) + " "));
    if (row.option.empty()) return;
    const std::string help = help_on(row.option);
    REQUIRE(help != "");
    const std::string standard = standard_of(row);
    const bool has_argument = !cbcan::base::option_argument(row.option).empty();
    if (has_argument && standard != kNone) CHECK(contains(help, "(default " + standard + ")"));
    if (has_argument) CHECK(contains(help, domain_of(row)));
  });
  CHECK(words_only(help_on("--clock CLOCK")).ends_with(": real or manual (default real) "));
}

TEST_CASE("-h fits one screen, and names only options that there are") {
  CHECK(lines_of(short_help_text()).size() <= 24);
  for (const std::string& option : options_in(short_help_text()))
    CHECK(known_options().contains(option));
}

TEST_CASE("--help has every device") {
  for (const auto& device : cbcan::devices::device_kinds()) {
    INFO(device.name);
    CHECK(contains(help_text(), "\n  " + std::string(device.name) + " "));
  }
  CHECK(contains(help_text(),
                 "\n  cia402  drive: power state machine, motion profiles, homing, cyclic\n"
                 "          synchronous modes\n"));
  CHECK(contains(help_text(), "docs/how-to/lua-device.md"));
}

TEST_CASE("--help has no option that does not exist") {
  std::set<std::string> known = known_options();
  known.erase("-h");
  CHECK(options_in(help_text()) == known);
}

TEST_CASE("--help fits a terminal of 80 columns and explains the exit codes") {
  for (const std::string& line : lines_of(help_text() + short_help_text())) {
    INFO(line);
    CHECK(line.size() <= 80);
  }
  for (const char* code :
       {"\n  0    done", "\n  1    a check failed", "\n  2    usage", "\n  3    environment"}) {
    CHECK(contains(help_text(), code));
  }
}

TEST_CASE("the examples in --help run") {
  CHECK(contains(help_text(), "cbcan-sim --demo --log bus.log\n"));
  CHECK(start({"--demo", "--log", "bus.log"}).err == "");
  CHECK(contains(help_text(), "cbcan-sim --can socketcan:vcan0 --modbus 0.0.0.0:502 --sdo-timeout 200\n"));
  CHECK(start({"--can", "socketcan:vcan0", "--modbus", "0.0.0.0:502", "--sdo-timeout", "200"}).err == "");
}

TEST_CASE("the reference names no option that does not exist") {
  for (const std::string& option : options_in(source_file("docs/reference/plant-file.md"))) {
    INFO(option);
    CHECK(known_options().contains(option));
  }
}

TEST_CASE("the reference's networks are the same on the command line") {
  const Plant plant = read(toml_snippets(source_file("docs/how-to/several-networks.md")).at(0));
  const Start typed = start({"--modbus",   ":502",       "--can",         "socketcan:can0",
                             "--network",  "2",          "--sdo-timeout", "200",
                             "--bit-rate", "125000",     "--slcan",       "127.0.0.1:29537",
                             "--log",      "second.log", "--node",        "5=io_module.eds",
                             "--network",  "3",          "--can",         "socketcan:can1"});
  REQUIRE(plant.errors == Lines{});
  REQUIRE(typed.err == "");
  CHECK(typed.config.modbus == plant.config.modbus);
  REQUIRE(plant.config.networks.size() == 3);
  REQUIRE(typed.config.networks.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    INFO(i);
    const NetworkConfig& in_file = plant.config.networks[i];
    const NetworkConfig& on_line = typed.config.networks[i];
    CHECK(in_file.number == on_line.number);
    CHECK(in_file.module == on_line.module);
    CHECK(in_file.can == on_line.can);
    CHECK(in_file.log == on_line.log);
    CHECK(in_file.nodes.size() == on_line.nodes.size());
  }
}

TEST_CASE("the errors in the reference have these messages") {
  const Plant plant = read(R"(# The mistakes of the reference, on the lines that it names.




[can]
bitrate = 250000
spec = "socketcan"



[[node]]
id = 5
eds = "a.eds"
[[node]]
id = 5
eds = "b.eds"
[[network]]
[network.module]
node_id = 128
)");
  Lines told = plant.errors;
  for (const std::string& line : to_lines(check(plant.config)))
    told.push_back(line);
  const Lines unreadable = read("\n\nspec = virtual\n").errors;
  told.insert(told.end(), unreadable.begin(), unreadable.end());
  for (const std::string& line : told) {
    INFO(line);
    CHECK(contains(source_file("docs/reference/plant-file.md"), "    " + line + "\n"));
  }
}
