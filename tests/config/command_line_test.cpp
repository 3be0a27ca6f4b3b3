// SPDX-License-Identifier: MIT

#include <iomanip>

#include "plant_support.hpp"
#include "support/case_file.hpp"

using namespace cbcan::config::test;
using namespace cbcan::test;

namespace {

Files disk_files() {
  return {{"plant.toml", R"([module]
node_id = 10
sdo_timeout_ms = 11
node_state_fresh_ms = 12
guarding_timeout_ms = 13
[modbus]
host = "10.0.0.1"
port = 14
[can]
spec = "socketcan:can0"
[log]
file = "file.log"
verbose = true
)"},
          {"valve.toml", kValve},
          {"node.eds", "\xEF\xBB\xBF; comment\r\n[fileinfo]\r\nFileName=node.eds\r\n"},
          {"tank.LUA", "SETTINGS = {}\n"},
          {"network.toml", "[[node]]\nid = 5\npdos = [{ tpdo = 1 }]\n"},
          {"scenario.toml", "[module]\nnode_id = 3\n  [[step]] # one\nafter = \"1s\"\n"},
          {"bad.toml", "[module]\nnode_id = 300\n[can]\nspec = \"socketcan\"\n"}};
}

/// The words of a line; 'a b' is one.
Lines words_in(const std::string& line) {
  std::istringstream stream(line);
  Lines words;
  for (std::string word; stream >> std::quoted(word, '\'');)
    words.push_back(word);
  return words;
}

}  // namespace

TEST_CASE("each command line of the table is refused with its message, and the hint at --help") {
  for (const FileCase& each : cases_of("tests/config/command_lines.txt")) {
    INFO(each.place);
    const Lines words = words_in(each.given.at(0));
    std::vector<const char*> arguments;
    for (const std::string& word : words)
      arguments.push_back(word.c_str());
    Lines lines = without("cbcan-sim: ", lines_of(refusal(arguments, disk_files())));
    REQUIRE(lines.size() > 1);
    CHECK(lines.back() + "\n" == kHint);
    lines.pop_back();
    each.check(lines);
  }
}

TEST_CASE("no option at all runs with the defaults and says who is missing") {
  const Start bare = start({});
  CHECK(bare.run);
  CHECK(bare.config == Config{});
  CHECK(bare.out == "");
  CHECK(bare.err ==
        "cbcan-sim: no other node is on the virtual bus; try --demo, or add a node: --node 5=FILE.eds\n");
}

TEST_CASE("a bit rate on a real bus is remarked on") {
  const Start real = start({"--can=socketcan:can1", "--bit-rate=125000"});
  CHECK(real.run);
  CHECK(real.err ==
        "cbcan-sim: can.bit_rate (--bit-rate) is for the virtual bus; socketcan:can1 has the one "
        "that it was set up with\n");
}

TEST_CASE("words of the PLC that FATEK reserves are remarked on") {
  const auto remarks = [](std::vector<const char*> sets, std::vector<const char*> more) {
    std::vector<const char*> arguments{"--demo"};
    for (const char* set : sets)
      arguments.insert(arguments.end(), {"--set", set});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return start(arguments).err;
  };
  const std::vector<const char*> plc{"--plc", "192.168.1.5:502"};
  const auto lies = [](const std::string& range, const char* free) {
    return "cbcan-sim: " + range +
           " would lie over R3840..R4167, which a FATEK FBs controller reserves; there set " + free + "\n";
  };
  const std::string old_page =
      lies("plc.process_first: R3800..R3927", "3300") + lies("plc.status_first: R3928..R4099", "3500");
  CHECK(remarks({"plc.process_first=3800", "plc.status_first=3928"}, plc) == old_page);
  CHECK(remarks({"plc.process_first=3800", "plc.status_first=3928"}, {}).empty());
  CHECK(remarks({"plc.process_first=3300", "plc.status_first=3500"}, plc).empty());
  CHECK(remarks({}, plc).empty());
  CHECK(remarks({"plc.process_first=3712", "plc.status_first=4168", "plc.first=3770"}, plc).empty());
  CHECK(remarks({"plc.process_first=3713"}, plc) == lies("plc.process_first: R3713..R3840", "3300"));
  CHECK(remarks({"plc.status_first=4167"}, plc) == lies("plc.status_first: R4167..R4338", "3500"));
  CHECK(remarks({"plc.first=3771"}, plc) == lies("plc.first: R3771..R3840", "3700"));
  CHECK(remarks({"plc.first=3703", "plc.layout=scanner", "plc.device=/dev/ttyUSB0"}, {}) ==
        lies("plc.first: R3703..R3840", "500"));
}

TEST_CASE("options and --set, both ways to write them") {
  Start apart =
      start({"--set", "module.node_id=3", "--sdo-timeout", "0", "--set", "module.node_state_fresh_ms=5",
             "--set", "module.guarding_timeout_ms=6", "--modbus", "0.0.0.0:0", "--can", "virtual",
             "--bit-rate", "1000000", "--log", "a.log", "--verbose", "--node", "5=a.eds"});
  Start joined = start({"--set=module.node_id=0x3", "--sdo-timeout=0", "--set=module.node_state_fresh_ms=5",
                        "--set=module.guarding_timeout_ms=6", "--modbus=0.0.0.0:0", "--can=virtual",
                        "--bit-rate=1000000", "--log=a.log", "-v", "--node=5=a.eds"});
  REQUIRE(apart.err == "");
  REQUIRE(joined.err == "");
  apart.config.networks.at(0).places.clear();  // contain what was typed: 3, 0x3
  joined.config.networks.at(0).places.clear();
  CHECK(apart.config == joined.config);
  CHECK(apart.config.networks.at(0).module == ModuleConfig{{3, 0, 1000, 5000, 6000}});
  CHECK(apart.config.modbus == ListenAddress{"0.0.0.0", 0});
  CHECK(apart.config.networks.at(0).can == CanConfig{"", 1000000, "", {}});
  CHECK(apart.config.networks.at(0).log == "a.log");
  CHECK(apart.config.verbose == true);
  CHECK(apart.config.networks.at(0).nodes.at(0).eds == "a.eds");
}

TEST_CASE("--rtu and --plc, and what else there is of them by --set") {
  const Start made = start({"--rtu",     "/dev/ttyS1",
                            "--set",     "rtu.baud=9600",
                            "--set",     "rtu.parity=N",
                            "--set",     "rtu.station=7",
                            "--plc",     "plc:502",
                            "--set",     "plc.unit=2",
                            "--set",     "plc.first=1024",
                            "--set",     "plc.layout=scanner",
                            "--set",     "plc.period_ms=50",
                            "--network", "2",
                            "--set",     "plc.device=/dev/ttyS2",
                            "--set",     "plc.baud=57600",
                            "--set",     "network.2.plc.unit=3",
                            "--set",     "plc.process_first=0"});
  REQUIRE(made.run);
  CHECK(made.config.rtu == RtuConfig{{"/dev/ttyS1", 9600, "N"}, 7, ""});
  CHECK(made.config.networks.at(0).plc ==
        PlcConfig{"plc:502", {}, 2, PlcLayout::kScanner, 1024, std::nullopt, std::nullopt, 50});
  CHECK(made.config.networks.at(1).plc ==
        PlcConfig{"", {"/dev/ttyS2", 57600, "E"}, 3, PlcLayout::kWindow, 3700, 0, std::nullopt, 10});
  CHECK(contains(
      start({"--plc", "plc", "--set", "plc.device=/dev/ttyS1"}).err,
      "plc.device: the PLC is at plc already; leave out one of plc.address (--plc) and plc.device\n"));
}

TEST_CASE("the command line wins over the plant file, wherever --config is") {
  const Start file = start({"--config", "plant.toml"}, disk_files());
  REQUIRE(file.err == "");
  CHECK(file.config.networks.at(0).module == ModuleConfig{{10, 11, 1000, 12000, 13000}});
  CHECK(file.config.modbus == ListenAddress{"10.0.0.1", 14});
  CHECK(file.config.networks.at(0).log == "file.log");
  CHECK(file.config.verbose == true);

  const Start both =
      start({"--set", "module.node_id=20", "--modbus", ":24", "--can", "virtual", "--set",
             "log.verbose=false", "--config", "plant.toml", "--sdo-timeout", "21", "--set",
             "module.node_state_fresh_ms=22", "--set", "module.guarding_timeout_ms=23", "--log", "line.log"},
            disk_files());
  REQUIRE(both.run);
  CHECK(both.config.networks.at(0).module == ModuleConfig{{20, 21, 1000, 22000, 23000}});
  CHECK(both.config.modbus == ListenAddress{"127.0.0.1", 24});
  CHECK(both.config.networks.at(0).can == CanConfig{});
  CHECK(both.config.networks.at(0).log == "line.log");
  CHECK(both.config.verbose == false);
}

TEST_CASE("a host alone keeps the port of the plant file") {
  const Start both = start({"--config", "plant.toml", "--modbus", "localhost"}, disk_files());
  CHECK(both.config.modbus == ListenAddress{"localhost", 14});
  CHECK(start({"--modbus", "[::1]:502"}).config.modbus == ListenAddress{"::1", 502});
}

TEST_CASE("a clash in the plant file may be settled on the command line") {
  const Files disk{{"p.toml", "[[node]]\nid = 127\neds = \"a.eds\"\n"}};
  CHECK_FALSE(start({"--config", "p.toml"}, disk).run);
  CHECK(start({"--config", "p.toml", "--set", "module.node_id=1"}, disk).run);
  CHECK_FALSE(start({"--node", "9=a.eds", "--set", "module.node_id=9"}).run);
}

TEST_CASE("a bad plant file is reported line by line, without the hint at options") {
  CHECK(refusal({"--config", "bad.toml", "--set", "node.5.name=x"}, disk_files()) ==
        "bad.toml:2: module.node_id 300: must be 1..127\n"
        "bad.toml:4: can.spec \"socketcan\": the interface is missing; write socketcan:vcan0\n");
}

TEST_CASE("help and version are asked for, not mistakes") {
  for (const auto& [option, text] : {std::pair("--help", help_text()), std::pair("-h", short_help_text())}) {
    const Start help = start({"--nonsense", option});
    CHECK_FALSE(help.run);
    CHECK(help.exit_code == ExitCode::kDone);
    CHECK(help.out == text);
    CHECK(help.err == "");
  }
  const Start version = start({"--version"});
  CHECK_FALSE(version.run);
  CHECK(version.exit_code == ExitCode::kDone);
  CHECK(version.out == "cbcan-sim " CBCAN_TEST_VERSION "\n");
}

TEST_CASE("--no-module leaves the module out, and its ID to a node") {
  CHECK_FALSE(start({"--demo", "--no-module"}).config.networks.at(0).module.enabled);
  CHECK(start({"--demo", "--no-module", "--node", "127=a.eds"}).run);
  const Files without{{"plant.toml", "[module]\nenabled = false\n"}};
  CHECK_FALSE(start({"--config", "plant.toml"}, without).config.networks.at(0).module.enabled);
  CHECK(start({"--config", "plant.toml", "--set", "module.enabled=true"}, without)
            .config.networks.at(0)
            .module.enabled);
}

TEST_CASE("a socket in a plant file is relative to the file") {
  const Files plant{{"plants/p.toml", "[can]\nslcan = \"unix:../run/can\"\n"},
                    {"q/p.toml", "[can]\nslcan = \"unix:\"\n"}};
  CHECK(start({"--config", "plants/p.toml"}, plant).config.networks.at(0).can.slcan == "unix:run/can");
  CHECK(contains(start({"--config", "q/p.toml"}, plant).err, "1..107"));
}

TEST_CASE("--clock is real or manual, and manual on the virtual bus") {
  CHECK(start({"--clock", "real"}).config == start({}).config);
  CHECK(start({"--demo", "--clock", "manual"}).config.clock == ClockKind::kManual);
}

TEST_CASE("a command follows --, for which the plant uses free addresses") {
  const Start made = start({"--demo", "--", "pytest", "--verbose", "tests"});
  REQUIRE(made.run);
  CHECK(made.command == std::vector<std::string>{"pytest", "--verbose", "tests"});
  CHECK(made.config.modbus == ListenAddress{"127.0.0.1", 0});
  CHECK(made.config.control == "127.0.0.1:0");
  CHECK(made.config.networks.at(0).can.slcan == "127.0.0.1:0");
  CHECK_FALSE(made.config.verbose);
  const Start named =
      start({"--demo", "--modbus", ":1600", "--control", "unix:/c", "--slcan", ":1601", "--", "x"});
  CHECK(named.config.modbus == ListenAddress{"127.0.0.1", 1600});
  CHECK(named.config.control == "unix:/c");
  CHECK(named.config.networks.at(0).can.slcan == ":1601");
  CHECK(start({"--can", "socketcan:can0", "--", "x"}).config.networks.at(0).can.slcan.empty());
  CHECK(start({"--demo"}).command.empty());
}

TEST_CASE("--check and --log -") {
  CHECK(start({"--demo", "--check"}).check);
  CHECK_FALSE(start({"--demo"}).check);
  CHECK(logs_to_standard_output(start({"--demo", "--log", "-"}).config));
  CHECK_FALSE(logs_to_standard_output(start({"--demo", "--log", "bus.log"}).config));
}
