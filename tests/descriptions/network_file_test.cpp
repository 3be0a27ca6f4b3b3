// SPDX-License-Identifier: MIT
// Network files: what is read, the module's objects made from it, and what is rejected.

#include "descriptions/network_file.hpp"
#include "base/text.hpp"
#include "support/case_file.hpp"
#include "support/complaint.hpp"

using namespace cbcan::descriptions;
using namespace cbcan::test;

namespace {

/// TPDO 1 maps 6000h:01 (8 bits), TPDO 2 6401h:01 (16 bits) and 6402h:01 (32 bits), RPDO 1 6200h:01; TPDO 3
/// is invalid. TPDO 2 has a constant type and no event timer.
const std::string kEds = cbcan::test::source_file("tests/descriptions/network.eds");

/// network.eds, whose 1017h is writable, guarded.eds, which has 100Ch and 100Dh instead, and variants of
/// them.
std::string device(const std::string& name) {
  std::string text = cbcan::test::source_file("tests/descriptions/" + name.substr(0, name.find(' ')));
  const auto replace = [&text](const std::string& section, const std::string& from, const std::string& to) {
    text.replace(text.find(from, text.find("[" + section + "]")), from.size(), to);
  };
  const auto has = [&name](const char* variant) { return name.find(variant) != std::string::npos; };
  if (has(" bare")) {
    replace("OptionalObjects", "0x100D", "0x100E");
    replace("100D", "100D", "100E");
  }
  if (has(" fixed")) replace("1017", "AccessType=rw\nDefaultValue=0", "AccessType=const\nDefaultValue=500");
  if (has(" period")) replace("1017", "PDOMapping=0", "PDOMapping=0\nParameterValue=60000");
  if (has(" silent")) replace("1017", "PDOMapping=0", "PDOMapping=0\nParameterValue=0");
  if (has(" default")) {
    replace("100C", "DefaultValue=0", "DefaultValue=0x32");
    replace("100D", "DefaultValue=0", "DefaultValue=4");
  }
  if (has(" both")) {
    replace("OptionalObjects", "13\n", "15\n14=0x100C\n15=0x100D\n");
    const std::string guarded = cbcan::test::source_file("tests/descriptions/guarded.eds");
    const std::size_t first = guarded.find("[100C]");
    text += guarded.substr(first, guarded.find("[1018]") - first);
  }
  if (has(" guarding")) {
    replace("100C", "PDOMapping=0", "PDOMapping=0\nParameterValue=0xC8");
    replace("100D", "PDOMapping=0", "PDOMapping=0\nParameterValue=2");
  }
  return text + "[DeviceComissioning]\nNodeID=5\n";
}

cbcan::base::FileReader reader_of(const std::map<std::string, std::string>& files) {
  return [&files](const std::string& path) {
    const auto found = files.find(path);
    return found == files.end() ? std::nullopt : std::optional(found->second);
  };
}

PlannedNetwork read(const std::string& text) {
  std::vector<std::string> remarks;
  const std::map<std::string, std::string> files{{"n.toml", text},
                                                 {"d.eds", kEds},
                                                 {"g.eds", device("guarded.eds")},
                                                 {"f.eds", device("network.eds fixed")}};
  PlannedNetwork network = read_network("n.toml", reader_of(files), remarks);
  CHECK(remarks.empty());
  return network;
}

/// What is wrong; "" = nothing.
std::string problem(const std::string& text) {
  return complaint_of<UsageError>([&] { image_of(read(text), 127, "n.toml"); });
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

TEST_CASE("how a node is watched: by the file, by its objects, or by what its device can") {
  struct Row {
    const char* device;  ///< empty = none
    const char* keys;
    unsigned heartbeat_ms, guard_ms, factor;
    const char* objects;
  };
  const std::string period = "objects = [ { index = 0x1017, value = 200, type = \"u16\" } ]\n";
  const std::string guarding =
      "objects = [ { index = 0x100C, value = 70, type = \"u16\" }, "
      "{ index = 0x100D, value = 5, type = \"u8\" } ]\n";
  for (const Row& row : {
           Row{"eds network.eds", "", 1000, 0, 0, "1017:00=E803"},
           Row{"eds network.eds", "heartbeat_ms = 300", 300, 0, 0, "1017:00=2C01"},
           Row{"eds network.eds", "heartbeat_ms = 0", 0, 0, 0, ""},
           Row{"eds network.eds", "boot = false", 0, 0, 0, ""},
           Row{"eds network.eds", period.c_str(), 200, 0, 0, "1017:00=C800"},
           Row{"eds network.eds fixed", "", 500, 0, 0, ""},
           Row{"eds network.eds both", "", 1000, 0, 0, "1017:00=E803"},
           Row{"eds network.eds both", guarding.c_str(), 0, 70, 5, "100C:00=4600 100D:00=05"},
           Row{"eds network.eds both", "heartbeat_ms = 0", 0, 0, 0, ""},
           Row{"eds network.eds both", "boot = false", 0, 1000, 3, ""},
           Row{"eds guarded.eds", "", 0, 1000, 3, ""},
           Row{"eds guarded.eds", "heartbeat_ms = 0", 0, 0, 0, ""},
           Row{"eds guarded.eds default", "", 0, 50, 4, ""},
           Row{"eds guarded.eds bare", "", 0, 0, 0, ""},
           Row{"dcf network.eds", "", 1000, 0, 0, "1017:00=E803"},
           Row{"dcf network.eds period", "", 60000, 0, 0, "1017:00=60EA"},
           Row{"dcf network.eds period", "heartbeat_ms = 300", 300, 0, 0, "1017:00=60EA 1017:00=2C01"},
           Row{"dcf network.eds period", period.c_str(), 200, 0, 0, "1017:00=60EA 1017:00=C800"},
           Row{"dcf network.eds silent", "", 0, 0, 0, "1017:00=0000"},
           Row{"dcf network.eds both silent", "", 0, 0, 0, "1017:00=0000"},
           Row{"dcf network.eds both guarding", "", 0, 200, 2, "100C:00=C800 100D:00=02"},
           Row{"dcf network.eds both guarding silent", "", 0, 200, 2, "100C:00=C800 100D:00=02 1017:00=0000"},
           Row{"dcf network.eds both guarding period", "", 60000, 0, 0,
               "100C:00=C800 100D:00=02 1017:00=60EA"},
           Row{"dcf guarded.eds guarding", "", 0, 200, 2, "100C:00=C800 100D:00=02"},
           Row{"", "", 0, 0, 0, ""},
           Row{"", period.c_str(), 200, 0, 0, "1017:00=C800"},
           Row{"", guarding.c_str(), 0, 70, 5, "100C:00=4600 100D:00=05"},
       }) {
    INFO(row.device << ": " << row.keys);
    const std::string name = row.device;
    const bool is_known = !name.empty();
    std::map<std::string, std::string> files{
        {"n.toml", "[[node]]\nid = 5\n" + (is_known ? name.substr(0, 3) + " = \"x\"\n" : "") + "pdos = []\n" +
                       row.keys}};
    if (is_known) files["x"] = device(name.substr(4));
    std::vector<std::string> remarks;
    const PlannedNode node = read_network("n.toml", reader_of(files), remarks).all.at(0);
    CHECK((node.heartbeat_ms == row.heartbeat_ms && node.guard_ms == row.guard_ms));
    CHECK((node.retry_factor == row.factor && node.is_watched() == (row.heartbeat_ms + row.guard_ms != 0)));
    CHECK(written(node.objects) == row.objects);
  }
}

TEST_CASE("node guarding in 1F81h; a long heartbeat in the 16 bits of 1016h") {
  std::vector<std::string> remarks;
  std::map<std::string, std::string> files{{"n.toml", "[[node]]\nid = 5\neds = \"x\"\n"},
                                           {"x", device("guarded.eds")}};
  const auto image = [&] {
    return cbcan::base::hex(image_of(read_network("n.toml", reader_of(files), remarks), 127, "n.toml"), "");
  };
  CHECK(
      image().starts_with("04000000"
                          "801F000400000001000000"
                          "811F050400000005"
                          "03E803"));
  files["n.toml"] = "[[node]]\nid = 5\nobjects = [ { index = 0x1017, value = 60000, type = \"u16\" } ]\n";
  CHECK(image().find("16100104000000FFFF0500") != std::string::npos);
}

TEST_CASE("the module's objects, byte by byte") {
  const PlannedNetwork network =
      read("[[node]]\nid = 5\nheartbeat_ms = 100\nmandatory = true\nlss = true\nidentity = [0, 0x33]\n");
  CHECK(image_of(network, 127, "n.toml") ==
        Bytes{6,    0,    0, 0,                           // objects
              0x16, 0x10, 1, 4,  0, 0, 0, 250,  0, 5, 0,  // 1.5 x 100 + 100 ms
              0x80, 0x1F, 0, 4,  0, 0, 0, 1,    0, 0, 0,  //
              0x81, 0x1F, 5, 4,  0, 0, 0, 0xD,  0, 0, 0,  // listed, boots, mandatory
              0x86, 0x1F, 5, 4,  0, 0, 0, 0x33, 0, 0, 0,  //
              0x10, 0x30, 5, 1,  0, 0, 0, 1,              // it may get its node ID by LSS
              0x22, 0x1F, 5, 13, 0, 0, 0, 1,    0, 0, 0,  // one object: 1017h = 100
              0x17, 0x10, 0, 2,  0, 0, 0, 100,  0,        //
              0x52, 0x7B});                               // CRC
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
        "1017:00=E803 1802:01=85030080 1802:02=FF 1802:05=3200 1A02:00=00 1A02:01=08010060 1A02:00=01 "
        "1802:01=85030000");
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
  for (const FileCase& each : cases_of("tests/descriptions/network_mistakes.txt"))
    each.check(without("n.toml:", lines_of(problem(each.text()))));
}

namespace {

/// Nodes with one TPDO of 8 bits each, three lines each.
std::string nodes_with_pdos(int count) {
  std::string text;
  for (int i = 0; i != count; ++i)
    text += "[[node]]\nid = " + std::to_string(i + 1) +
            "\npdos = [ { tpdo = 1, can_id = " + std::to_string(0x181 + i) +
            ", map = [ { index = 0x6000, sub = 1, bits = 8 } ] } ]\n";
  return text;
}

}  // namespace

TEST_CASE("seventeen PDOs in a direction need further registers or have to be packed, 65 are too many") {
  CHECK(problem(nodes_with_pdos(17)) ==
        "n.toml:51: node 17: TPDO 1: R3800..R3863 have no room: set network.further_first, or network.place "
        "= \"packed\"");
  for (const std::string key : {"further_first = 100", "place = \"packed\""}) {
    const std::string head = "[network]\n" + key + "\n";
    CHECK(problem(head + nodes_with_pdos(64)).empty());
    CHECK(problem(head + nodes_with_pdos(65)) ==
          "n.toml:197: node 65: TPDO 1: the module has 64 RPDOs; map more objects into one, or leave this "
          "one out");
  }
}

TEST_CASE("own PDOs map the registers of their places") {
  const auto last = [](const std::string& key, int nodes) {
    return cbcan::base::hex(
        image_of(read("[network]\n" + key + "\n" + nodes_with_pdos(nodes)), 127, "n.toml"), "");
  };
  const auto has = [](const std::string& image, const std::string& object) {
    return image.find(object) != std::string::npos;
  };
  // RPDO 17: 1610h:01 = A048h:01, 8 bits; RPDO 64: 163Fh:01 = byte 376, A049h:7B; packed: A040h:11 and
  // A040h:40.
  CHECK(has(last("further_first = 100", 64), "10160104000000080148A0"));
  CHECK(has(last("further_first = 100", 64), "3F160104000000087B49A0"));
  CHECK(has(last("place = \"packed\"", 64), "10160104000000081140A0"));
  CHECK(has(last("place = \"packed\"", 64), "3F160104000000084040A0"));
}

TEST_CASE("more writes than the module has room for") {
  std::string text = "[[node]]\nid = 1\n";
  const std::string value = std::string(128, 'x');
  for (int node = 1; node <= 6; ++node) {
    if (node != 1) text += "[[node]]\nid = " + std::to_string(node) + "\n";
    text += "objects = [";
    for (int i = 0; i != 90; ++i)
      text += "{ index = 0x2000, value = \"" + value + "\", type = \"string\" },";
    text += "]\n";
  }
  // 4 + 11; a node 11 + 11 + 90 x (7 + 128) = 12,172.
  CHECK(problem(text) ==
        "n.toml:16: node 6: writes up to here take 73049 bytes, the module has 65535: leave default values "
        "out");
}

TEST_CASE("a folder with the DCF of each node") {
  const auto dcf = [](const std::string& id) { return kEds + "[DeviceComissioning]\nNodeID=" + id + "\n"; };
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
  wrong("line/b.dcf", kEds, "line: b.dcf: there is no NodeID in [DeviceComissioning]: is this a DCF?");
  wrong("line/", "d.eds\n",
        "line: no *.dcf in this folder; name a file in TOML, or export DCF files into it");
  CHECK_THROWS_WITH(read_network("n", reader_of(files), remarks),
                    "n: cannot be read; name a network file, or a folder of DCF files");
}
