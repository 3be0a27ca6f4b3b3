// SPDX-License-Identifier: MIT
// --help and docs/reference/plant-file.md say what the code does, no less and no more.

#include "cli/options.hpp"
#include "config/settings.hpp"
#include "devices/devices.hpp"
#include "plant_support.hpp"
#include "support/catch.hpp"
#include "text/words.hpp"

using namespace cbcan::cli;
using namespace cbcan::config;
using namespace cbcan::config::test;

namespace {

Lines lines_of(const std::string& text) {
  std::istringstream stream(text);
  Lines lines;
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
}

/// What --help says about one option, its lines joined; empty if it is not there.
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
  for (const std::string_view word : cbcan::text::words_of(text))
    joined += std::string(word) + " ";
  return joined;
}

/// The options named in a text: "--" and what belongs to it.
std::set<std::string> options_in(const std::string& text) {
  constexpr const char* kLetters = "abcdefghijklmnopqrstuvwxyz-";
  std::set<std::string> found;
  for (auto at = text.find("--"); at != std::string::npos; at = text.find("--", at + 2)) {
    const std::string word = text.substr(at, text.find_first_not_of(kLetters, at) - at);
    if (word.size() > 2 && word[2] != '-') found.insert(word);
  }
  return found;
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

TEST_CASE("--help has every option of every setting, with what it may be and its default") {
  for_each_setting([](const auto& row) {
    if (row.key.starts_with("node.signals.") || row.key.ends_with("faults.kind")) return;
    INFO(row.key);
    const std::string help = help_on(row.option);
    REQUIRE(help != "");
    const std::string standard = standard_of(row);
    if (standard != kNone && standard != kRequired) CHECK(contains(help, "(default " + standard + ")"));
    if (option_argument(row.option) != "") CHECK(contains(help, domain_of(row)));
  });
  CHECK(words_only(help_on("--node-id N")) == "--node-id N Its node ID on the bus: 1..127 (default 127) ");
}

TEST_CASE("--help has the keys of every shape of a signal, and every device") {
  const std::string help = help_on("--signal ID:INDEX:SUB=SHAPE KEY=VALUE...");
  for (const char* line : {"constant value", "ramp [from=0] to duration_ms [then=hold]",
                           "sine [mean=0] amplitude period_ms [phase_deg=0]",
                           "noise [mean=0] deviation [distribution=normal] [seed]",
                           "replay file [between=step] [repeat=false]", "all [sample_ms=10]"})
    CHECK(contains(words_only(help), line));
  for (const auto& device : cbcan::devices::device_kinds()) {
    INFO(device.name);
    CHECK(contains(help_text(), "\n  " + std::string(device.name) + " "));
  }
  CHECK(contains(help_text(),
                 "\n  cia402  drive: power state machine, motion profiles, homing, cyclic\n"
                 "          synchronous modes\n"));
}

TEST_CASE("--help has no option that does not exist") {
  std::set<std::string> known;
  for (const std::string_view option : all_options())
    known.emplace(option_name(option));
  CHECK(options_in(help_text()) == known);
}

TEST_CASE("--help fits a terminal of 80 columns and explains the exit codes") {
  for (const std::string& line : lines_of(help_text())) {
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
  std::set<std::string> known;
  for (const std::string_view option : all_options())
    known.emplace(option_name(option));
  for (const std::string& option : options_in(source_file("docs/reference/plant-file.md"))) {
    INFO(option);
    CHECK(known.count(option) == 1);
  }
}

TEST_CASE("the reference's command line makes the same node as its example") {
  const Plant plant = read(toml_snippets(source_file("docs/reference/plant-file.md")).at(0));
  const Start typed = start({"--node", "5=../devices/valve.dcf", "--object", "5:0x2001=17", "--object",
                             "5:0x2010:1=-1.5", "--object", "5:0x2011=Valve 5, boiler room", "--object",
                             "5:0x2012=hex:01 02 FF", "--object", "5:0x2013=true"});
  const NodeConfig& in_file = plant.config.networks.at(0).nodes.at(1);
  const NodeConfig& on_line = typed.config.networks.at(0).nodes.at(0);
  CHECK(in_file.id == on_line.id);
  CHECK(in_file.eds == on_line.eds);
  REQUIRE(in_file.objects.size() == on_line.objects.size());
  for (std::size_t i = 0; i < in_file.objects.size(); ++i) {
    CHECK(in_file.objects[i].index == on_line.objects[i].index);
    CHECK(in_file.objects[i].sub == on_line.objects[i].sub);
    CHECK((in_file.objects[i].value == on_line.objects[i].value));
  }
}

TEST_CASE("the reference's signals and faults are the same on the command line") {
  const Plant plant = read(toml_snippets(source_file("docs/reference/plant-file.md")).at(1));
  const Start typed = start(
      {"--node", "5=io_module.eds", "--signal", "5:0x6401:1=sine mean=1000 amplitude=200 period_ms=60000",
       "--signal", "5:0x6401:2=noise mean=512 deviation=1.5 sample_ms=100", "--signal",
       "5:0x6000:1=constant value=0x81", "--fault", "bus:frame-loss probability=0.001"});
  REQUIRE(plant.errors == Lines{});
  REQUIRE(typed.err == "");
  const auto& in_file = plant.config.networks.at(0).nodes.at(0).signals;
  const auto& on_line = typed.config.networks.at(0).nodes.at(0).signals;
  CHECK(on_line.at(0).signal == in_file.at(0).signal);
  CHECK(on_line.at(1).signal == in_file.at(1).signal);
  CHECK(on_line.at(2).signal == in_file.at(2).signal);
  CHECK(typed.config.networks.at(0).can.faults.at(0).fault ==
        plant.config.networks.at(0).can.faults.at(0).fault);
  CHECK(start({"--demo", "--fault", "1:response-late delay_ms=50 count=1"}).err == "");
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

TEST_CASE("the mistakes shown in the reference are told in these words") {
  const Plant plant = read(R"(# The mistakes of the reference, on the lines that it names.




[can]
bitrate = 250000
spec = "socketcan"

[module]
node_id = 300
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
