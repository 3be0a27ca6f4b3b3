// SPDX-License-Identifier: MIT
// Every mistake in a plant file and its message.
#include <fmt/core.h>

#include "plant_support.hpp"
#include "support/catch.hpp"

using namespace cbcan::config;
using namespace cbcan::config;
using namespace cbcan::config::test;

namespace {

constexpr std::string_view kNode = "[[node]]\nid = 5\neds = \"a.eds\"\n";

Lines errors_in(std::string_view text) {
  return read(text).errors;
}

/// Mistakes in the fourth line, in the table of a correct node.
Lines errors_in_node(const std::string& line) {
  return errors_in(std::string(kNode) + line + "\n");
}

Lines checked(std::string_view text) {
  return to_lines(check(read(text).config));
}

/// All mistakes in a file, in a node's fourth line, or in the whole configuration of a file.
template <class... Told>
void wrong(std::string_view text, const Told&... told) {
  INFO(text);
  CHECK(errors_in(text) == behind("plant.toml:", {told...}));
}

template <class... Told>
void wrong_node(const std::string& line, const Told&... told) {
  INFO(line);
  CHECK(errors_in_node(line) == behind("plant.toml:", {told...}));
}

template <class... Told>
void wrong_together(std::string_view text, const Told&... told) {
  INFO(text);
  CHECK(checked(text) == behind("plant.toml:", {told...}));
}

}  // namespace

TEST_CASE("unknown keys get a suggestion") {
  wrong("[can]\nbitrate = 1\n", "2: can.bitrate: no such key; did you mean can.bit_rate?");
  wrong("[module]\ntimeout = 1\n", "2: module.timeout: no such key; did you mean module.sdo_timeout_ms?");
  wrong("[modul]\n", "1: modul: no such key; did you mean module?");
  wrong("[[nodes]]\n", "1: nodes: no such key; did you mean node?");
  wrong_node("hearbeat_ms = 1", "4: node.hearbeat_ms: no such key; did you mean node.heartbeat_ms?");
  wrong_node("objects = [{ index = 1, vallue = 2, value = 3 }]",
             "4: node.objects.vallue: no such key; did you mean node.objects.value?");
  wrong_node("object = []", "4: node.object: no such key; did you mean node.objects?");
}

TEST_CASE("a key in the wrong table is shown the right one") {
  wrong("port = 502\n", "1: port: no such key; did you mean modbus.port?");
  wrong("[can]\nhost = \"a\"\n", "2: can.host: no such key; did you mean modbus.host?");
}

TEST_CASE("an unknown key that is like nothing gets the list") {
  wrong("[can]\nfoo = 1\n",
        "2: can.foo: no such key; can has spec, bit_rate, slcan, socketcand, replay, faults");
  wrong("[pump]\n",
        "1: pump: no such key; a plant file has module, plc, can, log, modbus, rtu, time, random, control, "
        "http, node, wire, network");
}

TEST_CASE("a key that several tables have, and not this one, gets the list") {
  wrong("[modbus]\nlisten = \"127.0.0.1:502\"\n", "2: modbus.listen: no such key; modbus has host, port");
}

TEST_CASE("keys after [[network]] are not the first network's") {
  wrong("[[network]]\n[module]\nnode_id = 5\n",
        "2: module: is of the first network; put it above [[network]], or write network.module");
  wrong("[[network]]\n[can]\n[[node]]\nid = 5\neds = \"a.eds\"\n",
        "2: can: is of the first network; put it above [[network]], or write network.can",
        "3: node: is of the first network; put it above [[network]], or write network.node");
  wrong("[[network]]\n[time]\nclock = \"manual\"\n[log]\nverbose = true\n");
}

TEST_CASE("a device that is called by what it is") {
  wrong_node("device = \"drive\"",
             "4: node.device \"drive\": must be none, cia401, cia402, cia404, cia406, cia408, cia410, or the "
             "path of a Lua script, "
             "FILE.lua; did you mean cia402?");
}

TEST_CASE("an address, or a serial port, can be had once") {
  CHECK(checked("[control]\nlisten = \"127.0.0.1:1502\"\n") ==
        Lines{"control.listen 127.0.0.1:1502: modbus.port has it already; write another one"});
  CHECK(checked("[control]\nlisten = \":5000\"\n[http]\nlisten = \"127.0.0.1:5000\"\n[[network]]\n"
                "[network.can]\nslcan = \":5000\"\n") ==
        Lines{"http.listen 127.0.0.1:5000: control.listen has it already; write another one",
              "plant.toml:7: network 2: can.slcan 127.0.0.1:5000: control.listen has it already; write "
              "another one"});
  CHECK(checked("[rtu]\ndevice = \"/dev/x\"\n[can]\nspec = \"slcan:/dev/../dev/x\"\n") ==
        Lines{"plant.toml:4: can.spec /dev/x: rtu.device has it already; write another one"});
  CHECK(checked("[control]\nlisten = \":0\"\n[http]\nlisten = \":0\"\n").empty());
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
  const std::string keys =
      "node.axis has negative_limit, positive_limit, home_low, home_high, stops_beyond, inertia_kgcm2, "
      "friction_mnm, gravity_mnm";
  wrong_node("axis = { 9.home_low = 7 }", "4: node.axis.9: no such key; " + keys);
  wrong_node("axis = { 1.home_low = 7 }", "4: node.axis.1: no such key; " + keys);
  wrong_node("axis = { 2 = { 3.home_low = 7 } }", "4: node.axis.3: no such key; " + keys);
  wrong_node("axis = { 2 = 5 }", "4: node.axis: must be a table; write axis = { inertia_kgcm2 = 10 }");
  wrong_node("axis = 5", "4: node.axis: must be a table; write axis = { inertia_kgcm2 = 10 }");
  wrong_node("axis = { inertia = 5 }",
             "4: node.axis.inertia: no such key; did you mean node.axis.inertia_kgcm2?");
  wrong_node("axis = { friction_mnm = -1 }", "4: node.axis.friction_mnm -1: must be 0..1000000 mNm");
}

TEST_CASE("numbers out of range, of nodes; the others: settings_test.cpp") {
  wrong("[[node]]\nid = 300\neds = \"a.eds\"\n", "2: node.id 300: must be 1..127");
  wrong_node("heartbeat_ms = 65536", "4: node.heartbeat_ms 65536: must be 0..65535 ms, 0 = none");
  wrong_node("objects = [{ index = 0x10000, sub = 256, value = 0 }]",
             "4: node.objects.index 65536: must be 0x0001..0xFFFF",
             "4: node.objects.sub 256: must be 0..255");
}

TEST_CASE("the bit rate is in bit/s") {
  const std::string range = "must be 10000..1000000 bit/s, or 0 = as fast as possible";
  wrong("[can]\nbit_rate = 500\n", "2: can.bit_rate 500: " + range + "; did you mean 500000?");
  wrong("[can]\nbit_rate = 9999\n", "2: can.bit_rate 9999: " + range);
  wrong("[can]\nbit_rate = 1000001\n", "2: can.bit_rate 1000001: " + range);
  for (const char* good : {"0", "10_000", "1_000_000"}) {
    INFO(good);
    CHECK(errors_in("[can]\nbit_rate = " + std::string(good)) == Lines{});
  }
}

TEST_CASE("values of the wrong type") {
  wrong("[module]\nnode_id = \"7\"\n", "2: module.node_id \"7\": must be an integer, 1..127");
  wrong("[module]\nnode_id = 7.0\n", "2: module.node_id 7.0: must be an integer, 1..127");
  wrong("[modbus]\nport = 1979-05-27\n", "2: modbus.port: must be an integer, 0..65535, 0 = any free one");
  CHECK(
      errors_in("[modbus]\nhost = 127\n") ==
      Lines{"plant.toml:2: modbus.host 127: must be a text in double quotes: an IP address or a host name"});
  wrong("[log]\nverbose = \"yes\"\n", "2: log.verbose \"yes\": must be true or false");
  wrong("[log]\nfile = true\n", "2: log.file true: must be a text in double quotes: a path");
  wrong_node("objects = [{ index = 1, value = [1] }]",
             "4: node.objects.value: must be a number, true or false, a text, or bytes as \"hex:01 02\"");
}

TEST_CASE("bus specifications") {
  const auto error_of = [](const std::string& spec) {
    const Lines errors = errors_in("[can]\nspec = \"" + spec + "\"\n");
    return errors.empty() ? "" : errors.at(0);
  };
  const std::string missing = ": the interface is missing; write socketcan:vcan0";
  const std::string no_address = ": the address is missing, or its port; write ";
  const std::string rates = "10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000 and 1000000";
  const std::string no_bus =
      ": the remote bus is missing, has a blank or more than 16 characters; write "
      "socketcand:127.0.0.1:29536/can0";
  struct Row {
    const char* spec;
    std::string error;  ///< after the key and the text
  };
  const std::vector<Row> rows{
      {"socketcan", missing},
      {"socketcan:", missing},
      {"virtual:1", ": the virtual bus has no interface; write virtual"},
      {"vcan0", ": no such bus; did you mean socketcan:vcan0?"},
      {"vritual", ": no such bus; did you mean virtual?"},
      {"sockectan:can1", ": no such bus; did you mean socketcan:can1?"},
      {"slcna", ": no such bus; did you mean slcan:/dev/ttyACM0?"},
      {"kvaser", ": no such bus; write virtual or socketcan:vcan0"},
      {"socketcan:abcdefghijklmnop", ": interface names have at most 15 characters"},
      {"socketcan:can 0", ": interface names have no blank, slash or colon; write socketcan:vcan0"},
      {"slcan", no_address + "slcan:/dev/ttyACM0 or slcan:HOST:PORT"},
      {"slcan:host", no_address + "slcan:/dev/ttyACM0 or slcan:HOST:PORT"},
      {"slcan:/dev/ttyACM0@500", ": \"500\" is no bit rate of an adapter; those are " + rates},
      {"slcan:/dev/ttyACM0@x", ": \"x\" is no bit rate of an adapter; those are " + rates},
      {"socketcand:host:1", no_bus},
      {"socketcand:host:1/a b", no_bus},
      {"socketcand:host/can0", no_address + "socketcand:127.0.0.1:29536/can0"},
      {"socketcan:abcdefghijklmno", ""},
      {"virtual", ""},
      {"slcan:/dev/ttyACM0", ""},
      {"slcan:/dev/ttyACM0@125000", ""},
      {"slcan:host:1@1000000", ""},
      {"socketcand:host:1/can0", ""},
  };
  for (const Row& row : rows) {
    const std::string text = fmt::format("plant.toml:2: can.spec \"{}\"{}", row.spec, row.error);
    CHECK(error_of(row.spec) == (row.error.empty() ? "" : text));
  }
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

TEST_CASE("what a node has to have") {
  wrong("[[node]]\n", "1: node.eds: is missing; add eds = \"FILE.eds\"",
        "1: node.id: is missing; add id = 5, or lss = true");
  wrong("[[node]]\neds = \"a.eds\"\nlss = false\n", "1: node.id: is missing; add id = 5, or lss = true");
  wrong("[[node]]\neds = \"a.eds\"\nid = 0\n", "3: node.id 0: must be 1..127");
  wrong("[[node]]\nidd = 5\nes = \"a.eds\"\n", "2: node.idd: no such key; did you mean node.id?",
        "3: node.es: no such key; did you mean node.eds?");
  wrong_node("objects = [\n{ sub = 1 }\n]", "5: node.objects.index: is missing; add index = 0x2001",
             "5: node.objects.value: is missing; add value = 1");
}

TEST_CASE("bytes that are none") {
  wrong_node(
      "objects = [{ index = 1, value = \"hex:0\" }]",
      "4: node.objects.value \"hex:0\": must be pairs of hex digits after hex:, such as \"hex:01 02 FF\"");
}

TEST_CASE("things of the wrong shape") {
  wrong("module = 5\n", "1: module: must be a table; write [module]");
  wrong("[[can]]\n", "1: can: must be a table; write [can]");
  const Lines node_list{"plant.toml:1: node: must be a list of tables; write [[node]] above each node"};
  CHECK(errors_in("[node]\nid = 5\n") == node_list);
  CHECK(errors_in("node = [5]\n") == node_list);
  const Lines object_list{
      "plant.toml:4: node.objects: must be a list; write objects = [{ index = 0x2001, sub = 0, value = 1 }]"};
  CHECK(errors_in_node("objects = 5") == object_list);
  CHECK(errors_in_node("objects = { index = 1, value = 2 }") == object_list);
  CHECK(errors_in_node("objects = [{ index = 1, value = 2 }, 5]") == object_list);
}

TEST_CASE("TOML syntax errors name the line") {
  const auto error_of = [](std::string_view text) { return errors_in(text).at(0); };
  CHECK(contains(error_of("[can]\nspec = virtual\n"), "plant.toml:2: TOML syntax: "));
  CHECK(contains(error_of("[can]\nspec = virtual\n"), "write texts in double quotes"));
  CHECK(contains(error_of("[can]\n\n\n[can]\n"), "plant.toml:4: TOML syntax: "));
  CHECK(contains(error_of("[module]\nnode_id = 1\nnode_id = 2\n"), "plant.toml:3: TOML syntax: "));
  CHECK(contains(error_of("[module\n"), "plant.toml:1: TOML syntax: "));
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

TEST_CASE("all mistakes at once, in line order") {
  wrong(R"([[node]]
id = 300
eds = 5
[modbus]
port = -1
hots = "a"
[can]
spec = "socketcan"
)",
        "2: node.id 300: must be 1..127",
        "3: node.eds 5: must be a text in double quotes: the path of an EDS or DCF file",
        "5: modbus.port -1: must be 0..65535, 0 = any free one",
        "6: modbus.hots: no such key; did you mean modbus.host?",
        "8: can.spec \"socketcan\": the interface is missing; write socketcan:vcan0");
}

TEST_CASE("an object twice") {
  wrong_together(std::string(kNode) +
                     "objects = [\n{ index = 0x2001, value = 1 },\n{ index = 0x2001, value = 2 },\n"
                     "{ index = 0x2001, sub = 1, value = 3 }]\n",
                 "6: node 5: object 2001h:00 is already set at plant.toml:5; remove one of the two");
  wrong_together(std::string(kNode) + "heartbeat_ms = 1\nobjects = [{ index = 0x1017, value = 1 }]\n",
                 "5: node 5: object 1017h:00 is already set at plant.toml:1; remove one of the two");
}

TEST_CASE("devices, LSS, parameters and addresses that are wrong") {
  wrong_node("device = \"cia405\"",
             "4: node.device \"cia405\": must be none, cia401, cia402, cia404, cia406, cia408, cia410, or "
             "the path of a Lua script, "
             "FILE.lua");
  wrong_node("device = 401",
             "4: node.device 401: must be a text in double quotes: the name of a device, or the path of a "
             "Lua script, FILE.lua");
  wrong_node("lss = 1", "4: node.lss 1: must be true or false");
  wrong_node("parameters = \"\"", "4: node.parameters \"\": must be a path");
  CHECK(
      contains(errors_in("[control]\nlisten = \"1502\"\n").at(0), "plant.toml:2: control.listen \"1502\": "));
}

TEST_CASE("signals that are wrong") {
  const auto wrong_signal = [](const std::string& keys, const auto&... told) {
    INFO(keys);
    CHECK(errors_in_node("signals = [{ index = 0x6401, " + keys + " }]") ==
          behind("plant.toml:4: node.signals.", {told...}));
  };
  wrong_signal("sub = 1", "shape: is missing; add shape = \"sine\"");
  wrong_signal("shap = 1", "shap: no such key; did you mean node.signals.shape?");
  wrong_signal("shape = \"square\", amplitude = 1",
               "shape \"square\": must be constant, ramp, sine, noise or replay");
  wrong_signal("shape = 3",
               "shape 3: must be a text in double quotes: constant, ramp, sine, noise or replay");
  wrong_signal("shape = \"constant\"", "value: is missing; add value = 1");
  wrong_signal("shape = \"ramp\"", "to: is missing; add to = 100",
               "duration_ms: is missing; add duration_ms = 10000");
  wrong_signal("shape = \"sine\"", "amplitude: is missing; add amplitude = 10",
               "period_ms: is missing; add period_ms = 60000");
  wrong_signal("shape = \"noise\"", "deviation: is missing; add deviation = 1");
  wrong_signal("shape = \"replay\"", "file: is missing; add file = \"FILE.csv\"");
  wrong_signal("shape = \"constant\", value = \"1\"", "value \"1\": must be a number");
  wrong_signal("shape = \"constant\", value = nan", "value nan: must be a number");
  wrong_signal("shape = \"constant\", value = -inf", "value -inf: must be a number");
  wrong_signal("shape = \"constant\", value = 1979-05-27", "value: must be a number");
  wrong_signal("shape = \"ramp\", to = 1, duration_ms = 0", "duration_ms 0: must be 1..86400000 ms");
  wrong_signal("shape = \"ramp\", to = 1, duration_ms = 1, then = \"stop\"",
               "then \"stop\": must be hold, repeat or back-and-forth");
  wrong_signal("shape = \"noise\", deviation = 1, distribution = \"gauss\"",
               "distribution \"gauss\": must be uniform or normal");
  wrong_signal("shape = \"constant\", value = 1, sample_ms = 0", "sample_ms 0: must be 1..86400000 ms");
  wrong_signal("shape = \"constant\", value = 1, vlaue = 1",
               "vlaue: no such key; did you mean node.signals.value?");
  CHECK(
      errors_in_node("signals = 5") ==
      Lines{"plant.toml:4: node.signals: must be a list; write signals = [{ index = 0x6401, sub = 1, shape = "
            "\"constant\", value = 1 }]"});
}

TEST_CASE("a key of another shape is answered with the keys of this shape") {
  const auto error_of = [](const std::string& keys) {
    return errors_in_node("signals = [{ index = 0x6401, " + keys + " }]").at(0);
  };
  CHECK(error_of("shape = \"constant\", value = 1, mean = 2") ==
        "plant.toml:4: node.signals.mean 2: shape \"constant\" has index, sub, shape, value and sample_ms");
  CHECK(
      error_of("shape = \"replay\", file = \"a.csv\", value = 1") ==
      "plant.toml:4: node.signals.value 1: shape \"replay\" has index, sub, shape, file, between, repeat and "
      "sample_ms");
}

TEST_CASE("faults that are wrong") {
  const auto errors_of = [](const std::string& keys) {
    return errors_in_node("faults = [{ " + keys + " }]");
  };
  CHECK(errors_of("delay_ms = 5") ==
        Lines{"plant.toml:4: node.faults.kind: is missing; add kind = \"response-late\""});
  CHECK(errors_of("kind = 5") ==
        Lines{"plant.toml:4: node.faults.kind 5: must be a text in double quotes: a kind of fault"});
  CHECK(errors_of("kind = \"silent\", probability = 2") ==
        Lines{"plant.toml:4: node.faults: silent: probability 2: must be 0..1"});
  wrong("[can]\nfaults = [\n{ kind = \"response-late\" },\n{ delay_ms = 1 }]\n",
        "3: can.faults: response-late: a fault of a node, not of the bus",
        "4: can.faults.kind: is missing; add kind = \"frame-loss\"");
  wrong("[can]\nfaults = \"bus-off\"\n",
        "2: can.faults: must be a list; write faults = [{ kind = \"frame-loss\" }]");
  wrong("[module]\nchannels = 1\nfaults = []\n",
        "3: module.faults: no such key; module has node_id, sdo_timeout_ms, block_timeout_ms, node_state_fresh_ms, "
        "guarding_timeout_ms, network, status_first, process_first, scanner_out_first, scanner_in_first, "
        "channels, plc_timeout_ms, "
        "plc_lost_state, start_result, parameters, enabled");
}

TEST_CASE("a signal twice, a parameter file twice") {
  wrong_together(std::string(kNode) +
                     "signals = [\n{ index = 0x6401, shape = \"constant\", value = 1 },\n"
                     "{ index = 0x6401, sub = 1, shape = \"constant\", value = 2 },\n"
                     "{ index = 0x6401, sub = 0, shape = \"noise\", deviation = 3 }]\n",
                 "7: node 5: object 6401h:00 already has a signal at plant.toml:5; remove one of the two");
  wrong_together(
      std::string(kNode) + "parameters = \"p\"\n[[node]]\nlss = true\neds = \"b\"\nparameters = \"p\"\n",
      "5: node without an ID: node.parameters p: node 5: node.parameters has it already at plant.toml:1; "
      "write another one");
}

TEST_CASE("ranges of registers do not overlap") {
  wrong_together("[module]\nprocess_first = 3700\n",
                 "2: R3700..R3827 of module.process_first would lie over R3700..R3769; every range needs "
                 "registers of its own");
  wrong_together("[module]\nscanner_in_first = 569\n",
                 "2: R569..R636 of module.scanner_in_first would lie over R500..R569 of "
                 "module.scanner_out_first; every range needs registers of its own");
  wrong_together("[module]\nprocess_first = 432\n",
                 "2: R500..R569 of module.scanner_out_first would lie over R432..R559 of "
                 "module.process_first; every range needs registers of its own");
  wrong_together("[module]\nscanner_in_first = 3928\n",
                 "2: R3928..R3995 of module.scanner_in_first would lie over R3928..R4099 of "
                 "module.status_first; every range needs registers of its own");
  CHECK(checked("[module]\nscanner_out_first = 3630\nscanner_in_first = 4200\nchannels = 1\n").empty());
  CHECK(
      checked("[module]\nscanner_out_first = 3630\nscanner_in_first = 4200\n") ==
      Lines{
          "plant.toml:2: R3830..R3899 of module.scanner_out_first, channel 2 would lie over R3800..R3927 of "
          "module.process_first; every range needs registers of its own, or fewer channels do: "
          "module.channels"});
  CHECK(checked("[module]\nscanner_out_first = 532\nscanner_in_first = 602\nprocess_first = 404\n").empty());
}
