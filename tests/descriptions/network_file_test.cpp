// SPDX-License-Identifier: MIT
// Network files: what is read, the module's objects made from it, and what is rejected.

#include "base/numbers.hpp"
#include "descriptions/network_file.hpp"
#include "descriptions/network_image.hpp"
#include "support/catch.hpp"

using namespace cbcan::descriptions;

namespace {

/// TPDO 1 maps 6000h:01 (8 bits), TPDO 2 6401h:01 (16 bits) and 6402h:01 (32 bits), RPDO 1 6200h:01; TPDO 3
/// is invalid. TPDO 2 has a constant type and no event timer.
const std::string kEds = R"([FileInfo]
[DeviceInfo]
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[OptionalObjects]
SupportedObjects=11
1=0x1017
2=0x1400
3=0x1600
4=0x1800
5=0x1801
6=0x1802
7=0x1A00
8=0x1A01
9=0x1A02
10=0x6000
11=0x6200
[ManufacturerObjects]
SupportedObjects=0
)";

std::string var(const std::string& section, const std::string& type, const std::string& access,
                const std::string& value, bool mappable = false) {
  return "[" + section + "]\nParameterName=" + section + "\nObjectType=7\nDataType=" + type +
         "\nAccessType=" + access + "\nDefaultValue=" + value + "\nPDOMapping=" + (mappable ? "1" : "0") +
         "\n";
}
std::string record(const std::string& index, const std::vector<std::string>& subs) {
  std::string text = "[" + index + "]\nParameterName=" + index +
                     "\nObjectType=9\nSubNumber=" + std::to_string(subs.size()) + "\n";
  for (const std::string& sub : subs)
    text += sub;
  return text;
}

std::string eds() {
  const auto pdo = [](const std::string& index, const std::string& cob, const std::string& type) {
    std::vector<std::string> subs{var(index + "sub0", "5", "ro", index == "1801" ? "2" : "5"),
                                  var(index + "sub1", "7", "rw", cob),
                                  var(index + "sub2", "5", index == "1801" ? "const" : "rw", type)};
    if (index != "1801") subs.push_back(var(index + "sub5", "6", "rw", "0"));
    return record(index, subs);
  };
  const auto map = [](const std::string& index, const std::vector<std::string>& entries) {
    std::vector<std::string> subs{var(index + "sub0", "5", "rw", std::to_string(entries.size()))};
    for (std::size_t i = 0; i != entries.size(); ++i)
      subs.push_back(var(index + "sub" + std::to_string(i + 1), "7", "rw", entries[i]));
    return record(index, subs);
  };
  return kEds + var("1000", "7", "ro", "0x000F0191") + var("1001", "5", "ro", "0") +
         var("1017", "6", "rw", "0") +
         record("1018", {var("1018sub0", "5", "ro", "2"), var("1018sub1", "7", "ro", "0x22"),
                         var("1018sub2", "7", "ro", "0x33")}) +
         pdo("1400", "$NODEID+0x200", "255") + map("1600", {"0x62000108"}) +
         pdo("1800", "$NODEID+0x180", "255") + pdo("1801", "$NODEID+0x280", "1") +
         pdo("1802", "$NODEID+0x80000380", "255") + map("1A00", {"0x60000108"}) +
         map("1A01", {"0x64010110", "0x64020120"}) + map("1A02", {"0x60000108"}) +
         record("6000", {var("6000sub0", "5", "ro", "1"), var("6000sub1", "5", "ro", "0", true)}) +
         record("6200", {var("6200sub0", "5", "ro", "1"), var("6200sub1", "5", "rww", "0", true)}) +
         record("6401", {var("6401sub0", "5", "ro", "1"), var("6401sub1", "3", "ro", "0", true)}) +
         record("6402", {var("6402sub0", "5", "ro", "1"), var("6402sub1", "7", "ro", "0", true)});
}

std::string all_sections() {
  std::string text = eds();
  const std::string from = "SupportedObjects=11\n";
  text.replace(text.find(from), from.size(), "SupportedObjects=13\n12=0x6401\n13=0x6402\n");
  return text;
}

cbcan::base::FileReader reader_of(const std::map<std::string, std::string>& files) {
  return [&files](const std::string& path) {
    const auto found = files.find(path);
    return found == files.end() ? std::nullopt : std::optional(found->second);
  };
}

PlannedNetwork read(const std::string& text) {
  std::vector<std::string> remarks;
  const std::map<std::string, std::string> files{{"n.toml", text}, {"d.eds", all_sections()}};
  PlannedNetwork network = read_network("n.toml", reader_of(files), remarks);
  CHECK(remarks.empty());
  return network;
}

/// What is wrong; "" = nothing.
std::string problem(const std::string& text) try {
  image_of(read(text), 127, "n.toml");
  return {};
} catch (const UsageError& error) {
  return error.what();
}

std::string written(const std::vector<PlannedObject>& objects) {
  std::string text;
  for (const PlannedObject& object : objects)
    text += (text.empty() ? "" : " ") + cbcan::base::hex(object.index, 4) + ":" +
            cbcan::base::hex(object.sub, 2) + "=" + cbcan::base::hex(object.value, "");
  return text;
}

}  // namespace

TEST_CASE("a node by its EDS: identity, heartbeat, objects") {
  const PlannedNetwork network = read(R"(
[[node]]
id = 5
eds = "d.eds"
heartbeat_ms = 100
objects = [ { index = 0x6200, sub = 1, value = 3 } ]
)");
  REQUIRE(network.all.size() == 1);
  const PlannedNode& node = network.all[0];
  CHECK(written(node.identity) == "1000:00=91010F00 1018:01=22000000 1018:02=33000000");
  CHECK(written(node.objects) == "1017:00=6400 6200:01=03");
}

TEST_CASE("the module's objects, byte by byte") {
  const PlannedNetwork network =
      read("[[node]]\nid = 5\nheartbeat_ms = 100\nmandatory = true\nidentity = [0, 0x33]\n");
  CHECK(image_of(network, 127, "n.toml") ==
        Bytes{5,    0,    0, 0,                           // objects
              0x16, 0x10, 1, 4,  0, 0, 0, 250,  0, 5, 0,  // 1.5 x 100 + 100 ms
              0x80, 0x1F, 0, 4,  0, 0, 0, 1,    0, 0, 0,  //
              0x81, 0x1F, 5, 4,  0, 0, 0, 0xD,  0, 0, 0,  // listed, boots, mandatory
              0x86, 0x1F, 5, 4,  0, 0, 0, 0x33, 0, 0, 0,  //
              0x22, 0x1F, 5, 13, 0, 0, 0, 1,    0, 0, 0,  // one object: 1017h = 100
              0x17, 0x10, 0, 2,  0, 0, 0, 100,  0,        //
              0x3D, 0x83});                               // CRC
}

TEST_CASE("PDOs as in the EDS are not written, others are") {
  const PlannedNetwork network = read(R"(
[[node]]
id = 5
eds = "d.eds"
pdos = [ { tpdo = 1 }, { tpdo = 2 }, { tpdo = 3, can_id = 0x385, event_ms = 50 }, { rpdo = 1 } ]
)");
  const PlannedNode& node = network.all[0];
  CHECK(written(node.objects) ==
        "1802:01=85030080 1802:02=FF 1802:05=3200 1A02:00=00 1A02:01=08010060 1A02:00=01 1802:01=85030000");
  REQUIRE(node.pdos.size() == 4);
  CHECK((node.pdos[0].can_id == 0x185 && node.pdos[1].can_id == 0x285 && node.pdos[3].can_id == 0x205));
  CHECK((node.pdos[0].own == 1 && node.pdos[1].own == 2 && node.pdos[2].own == 3 && node.pdos[3].own == 1));
  CHECK((node.pdos[1].bytes() == 6 && node.pdos[1].type == 1));
}

TEST_CASE("own PDOs map the registers of their slots") {
  const auto own = [](const std::string& head) {
    const std::string nodes = "[[node]]\nid = 5\neds = \"d.eds\"\npdos = [ { tpdo = 2 } ]\n";
    return cbcan::base::hex(image_of(read(head + nodes), 127, "n.toml"), "");
  };
  const auto has = [](const std::string& image, const std::string& object) {
    return image.find(object) != std::string::npos;
  };
  const std::string low = own("");
  CHECK(has(low, "00160104000000080140A0"));  // 1600h:01 = A040h:01, 8 bits
  CHECK(has(low, "00160604000000080640A0"));
  CHECK(has(low, "0016000100000006"));
  CHECK(has(low, "0014010400000085020000"));
  CHECK(has(low, "0A30010A00000005001001016420010264"));  // read at the start: not, as it is synchronous
  const std::string high = own("[network]\nwords = \"high-first\"\n");
  CHECK(has(high, "00160104000000080140A0"));
  CHECK(has(high, "00160204000000080240A0"));
  CHECK(has(high, "00160304000000100300A1"));  // A100h:03, then :02: the words in the other order
  CHECK(has(high, "00160404000000100200A1"));
  CHECK(has(high, "0016000100000004"));
}

TEST_CASE("the keys of the network") {
  const Bytes image = image_of(read(R"(
[network]
outputs = "at-once"
own_node = "plc"
nodes = "plc"
start_together = true
mandatory_lost = "stop"
boot_time_ms = 5000
sync_us = 10000
)"),
                               127, "n.toml");
  CHECK(image == Bytes{5,    0,    0, 0,                                //
                       0x06, 0x10, 0, 4, 0, 0, 0, 0x10, 0x27, 0, 0,     // 10,000 us
                       0x05, 0x10, 0, 4, 0, 0, 0, 0x80, 0,    0, 0x40,  // producer
                       0x80, 0x1F, 0, 4, 0, 0, 0, 0x4F, 0,    0, 0,     //
                       0x89, 0x1F, 0, 4, 0, 0, 0, 0x88, 0x13, 0, 0,     //
                       0x0B, 0x30, 0, 1, 0, 0, 0, 1,                    //
                       0xC1, 0xC4});                                    // CRC
}

TEST_CASE("a node that stores its configuration gets its number") {
  const PlannedNetwork network = read("[[node]]\nid = 5\nheartbeat_ms = 100\nstore = true\n");
  const Bytes image = image_of(network, 127, "n.toml");
  const Bytes again = image_of(network, 127, "n.toml");
  CHECK(image == again);
  const Bytes save{0x10, 0x10, 1, 4, 0, 0, 0, 's', 'a', 'v', 'e'};
  CHECK(std::equal(save.rbegin(), save.rend(), image.rbegin() + 2));  // before the CRC
}

TEST_CASE("mistakes name line and node") {
  struct Case {
    std::string text;
    std::string problem;
  };
  const std::string node = "[[node]]\nid = 5\neds = \"d.eds\"\n";
  const std::vector<Case> cases{
      {"[[node]]\nid = 300\n", "n.toml:2: node 300: node IDs are 1..127"},
      {"[[node]]\nid = 1e300\n", "n.toml:2: id 1e+300: must be an integer, 1..127"},
      {"[[node]]\nid = -1e300\n", "n.toml:2: id -1e+300: must be an integer, 1..127"},
      {"[[node]]\nid = nan\n", "n.toml:2: id nan: must be an integer, 1..127"},
      {"[[node]]\nid = 5.0\n", "n.toml:2: id 5.0: must be an integer, 1..127"},
      {"[network]\nsync_us = 1e300\n",
       "n.toml:2: sync_us 1e+300: must be an integer, 0..2147483647 us, 0 = no SYNC"},
      {"[[node]]\nid = 5\nobjects = [{ index = 1e300 }]\n", "n.toml:3: node 5: index: must be 0..0xffff"},
      {"[[node]]\nid = 5\nobjects = [{ index = 0x2000, value = 1e300, type = \"u32\" }]\n",
       "n.toml:3: node 5: '1e+300' is no u32: write a decimal number, 0x12 or 12h"},
      {"[[node]]\n", "n.toml:1: id is missing"},
      {"node = 5\n", "n.toml:1: node: must be a list of tables"},
      {"[[node]]\nid = 5\nobjects = [\n{ index = 0x2001, value = 300, type = \"u8\" }]\n",
       "n.toml:4: node 5: '300' is no u8: its range is 0..255"},
      {"[[node]]\nid = 5\nobjects = [{ index = 0x2001, type = \"u8\" }]\n",
       "n.toml:3: node 5: value is missing, or no number, text or truth"},
      {"[[node]]\nid = 5\nidentity = [-1]\n", "n.toml:3: node 5: identity: must be 0..0xffffffff"},
      {"[[node]]\nid = 5\n[[node]]\nid = 5\n", "n.toml:3: node 5: the node of line 1 has this ID already"},
      {"[[node]]\nid = 5\neds = \"x.eds\"\n",
       "n.toml:3: node 5: x.eds: cannot be read; the path is relative to this file"},
      {"[[node]]\nid = 127\n",
       "n.toml: node 127 is the module's own node: another module.node_id, or leave it out"},
      {"[network]\noutputs = \"now\"\n", "n.toml:2: outputs \"now\": must be written or at-once"},
      {"[network]\noutput = 1\n", "n.toml:2: output: no such key; did you mean outputs?"},
      {"[nodes]\n", "n.toml:1: nodes: no such key; did you mean node?"},
      {node + "heartbeat_ms = 50000\n",
       "n.toml:4: node 5: heartbeat_ms 50000: must be 0..43000 ms, 0 = no supervision"},
      {node + "objects = [ { index = 0x2000, value = 1 } ]\n",
       "n.toml:4: node 5: 2000h:00 is not in the EDS: check index and sub, or add type"},
      {"[[node]]\nid = 5\nobjects = [ { index = 0x2000, value = 1 } ]\n",
       "n.toml:3: node 5: type is missing: u8, u16, ..., string or hex"},
      {node + "objects = [ { index = 0x1000, value = 1 } ]\n",
       "n.toml:4: node 5: 1000h:00 is read-only in the EDS: leave it out"},
      {node + "pdos = [ { tpdo = 1, rpdo = 1 } ]\n", "n.toml:4: node 5: pdos: needs one of tpdo and rpdo"},
      {node + "pdos = [ { tpdo = 9 } ]\n", "n.toml:4: node 5: TPDO 9: maps nothing: add map = [...]"},
      {node + "pdos = [ { tpdo = 1 }, { tpdo = 1 } ]\n", "n.toml:4: node 5: TPDO 1: line 4 has it already"},
      {node + "pdos = [ { tpdo = 1 }, { tpdo = 2, can_id = 0x185 } ]\n",
       "n.toml:4: node 5: TPDO 2: node 5, TPDO 1 has CAN-ID 0x185 already: set another can_id"},
      {node + "pdos = [ { rpdo = 1, can_id = 0x80 } ]\n",
       "n.toml:4: node 5: RPDO 1: SYNC has CAN-ID 0x80 already: set another can_id"},
      {node + "pdos = [ { rpdo = 1, can_id = 0x100 } ]\n",
       "n.toml:4: node 5: RPDO 1: TIME has CAN-ID 0x100 already: set another can_id"},
      {node + "pdos = [ { rpdo = 1, can_id = 0x86 } ]\n[[node]]\nid = 6\n",
       "n.toml:4: node 5: RPDO 1: node 6, EMCY has CAN-ID 0x86 already: set another can_id"},
      {node + "pdos = [ { rpdo = 1, can_id = 0x85 } ]\n", ""},  // its EDS has no EMCY
      {node + "pdos = [ { rpdo = 1, can_id = 0xFF } ]\n",
       "n.toml:4: node 5: CAN-ID 0xff is that of the module's EMCY: set another can_id, or another "
       "module.node_id"},
      {node + "pdos = [ { tpdo = 513 } ]\n", "n.toml:4: node 5: tpdo: must be 1..512"},
      {node + "pdos = [ { tpdo = 0 } ]\n", "n.toml:4: node 5: tpdo: must be 1..512"},
      {node + "pdos = [ { tpdo = 1, type = 251 } ]\n",
       "n.toml:4: node 5: TPDO 1: type 251 is reserved: must be 0..240 or 252..255"},
      {node + "pdos = [ { tpdo = 1, type = 252 } ]\n", ""},
      {node + "pdos = [ { rpdo = 1, type = 253 } ]\n",
       "n.toml:4: node 5: RPDO 1: type 253 is reserved: must be 0..240 or 254..255"},
      {node + "pdos = [ { tpdo = 1, inhibit_us = 50 } ]\n",
       "n.toml:4: node 5: TPDO 1: inhibit_us 50: must be a multiple of 100"},
      {node + "pdos = [ { tpdo = 1, inhibit_us = 100 } ]\n",
       "n.toml:4: node 5: TPDO 1: 1800h:03 is not in the EDS: leave out inhibit_us"},
      {node + "pdos = [ { tpdo = 2, event_ms = 100 } ]\n",
       "n.toml:4: node 5: TPDO 2: 1801h:05 is not in the EDS: leave out event_ms"},
      {node + "pdos = [ { tpdo = 2, type = 2 } ]\n",
       "n.toml:4: node 5: TPDO 2: 1801h:02 is read-only in the EDS: leave out type"},
      {node + "pdos = [ { tpdo = 2, can_id = 0x300 } ]\n", ""},
      {node + "pdos = [ { tpdo = 1, map = [ { index = 0x6000, sub = 1 }, { index = 0x6000, sub = 1 } ] } ]\n",
       ""},  // real files have too few sub-indices
      {node + "pdos = [ { tpdo = 1, map = [ { index = 0x9000, sub = 1 } ] } ]\n",
       "n.toml:4: node 5: map: 9000h:01 is not in the EDS"},
      {"[[node]]\nid = 5\npdos = [ { tpdo = 1, map = [ { index = 0x9000, sub = 1 } ] } ]\n",
       "n.toml:3: node 5: map: bits is missing"},
      {node + "pdos = [ { tpdo = 1, map = [ { index = 0x6000, sub = 1, bits = 0 } ] } ]\n",
       "n.toml:4: node 5: bits: must be 1..64"},
      {node + "pdos = [ { tpdo = 1, can_id = 0x5FF } ]\n",
       "n.toml:4: node 5: TPDO 1: can_id 0x5ff is restricted (CiA 301, 7.3.5)"},
      {node + "pdos = [ { tpdo = 1, map = [ { index = 0x6200, sub = 1 } ] } ]\n",
       "n.toml:4: node 5: TPDO 1: 6200h:01 is an output of the node, map it into an RPDO"},
      {node + "pdos = [ { rpdo = 1, map = [ { index = 0x6401, sub = 1 } ] } ]\n",
       "n.toml:4: node 5: RPDO 1: 6401h:01 is an input of the node, map it into a TPDO"},
      {node + "pdos = [ { tpdo = 1, map = [ { index = 0x1017 } ] } ]\n",
       "n.toml:4: node 5: TPDO 1: 1017h:00 cannot be mapped: PDOMapping in the EDS"},
      {node + "pdos = [ { tpdo = 1, map = [ { index = 0x7000, bits = 8 } ] } ]\n",
       "n.toml:4: node 5: TPDO 1: 7000h:00 is not in the EDS"},
      {node + "pdos = [ { tpdo = 1, map = [ { index = 0x6402, sub = 1 }, { index = 0x6402, sub = 1 }, { "
              "index = 0x6000, sub = 1 } ] } ]\n",
       "n.toml:4: node 5: TPDO 1: maps more than 64 bits"},
      {"[network]\nwords = \"high-first\"\n" + node +
           "pdos = [ { tpdo = 1, map = [ { index = 0x6000, sub = 1 }, { index = 0x6402, sub = 1 } ] } ]\n",
       "n.toml:6: node 5: TPDO 1: 6402h:01 has 32 bits and does not begin at a register: words = "
       "\"high-first\" needs that"},
  };
  for (const Case& each : cases) {
    INFO(each.text);
    CHECK(problem(each.text) == each.problem);
  }
}

TEST_CASE("seventeen PDOs in a direction are one too many") {
  std::string text;
  for (int i = 0; i != 17; ++i)
    text += "[[node]]\nid = " + std::to_string(i + 1) +
            "\npdos = [ { tpdo = 1, can_id = " + std::to_string(0x181 + i) +
            ", map = [ { index = 0x6000, sub = 1, bits = 8 } ] } ]\n";
  CHECK(problem(text).find("n.toml:51: node 17: TPDO 1: the module has 16 RPDOs") == 0);
}

TEST_CASE("a folder with the DCF of each node") {
  const auto dcf = [](const std::string& id) {
    return all_sections() + "[DeviceComissioning]\nNodeID=" + id + "\n";
  };
  std::map<std::string, std::string> files{
      {"line/", "a.DCF\nb.dcf\nd.eds\n"}, {"line/a.DCF", dcf("7")}, {"line/b.dcf", dcf("6")}};
  std::vector<std::string> remarks;
  const PlannedNetwork network = read_network("line", reader_of(files), remarks);
  REQUIRE(network.all.size() == 2);
  CHECK((network.all[0].id == 7 && network.all[1].id == 6));
  REQUIRE(network.all[1].pdos.size() == 3);
  CHECK((network.all[1].pdos[2].can_id == 0x286 && network.all[1].pdos[2].own == 4));
  const auto wrong = [&](const std::string& name, const std::string& text, const std::string& message) {
    files[name] = text;
    CHECK_THROWS_WITH(read_network("line", reader_of(files), remarks), message);
  };
  wrong("line/b.dcf", dcf("7"), "line: node 7: b.dcf: a.DCF has this ID already");
  wrong("line/b.dcf", all_sections(),
        "line: b.dcf: there is no NodeID in [DeviceComissioning]: is this a DCF?");
  wrong("line/", "d.eds\n",
        "line: no *.dcf in this folder; name a file in TOML, or export DCF files into it");
  CHECK_THROWS_WITH(read_network("n", reader_of(files), remarks),
                    "n: cannot be read; name a network file, or a folder of DCF files");
}
