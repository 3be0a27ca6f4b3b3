// SPDX-License-Identifier: MIT
// Network files for the nodes of a scan.
#include "cbcanctl/network_text.hpp"

#include "base/error.hpp"
#include "support/catch.hpp"

using namespace cbcan::tools;

namespace {

std::string object(const std::string& name, const std::string& type, const std::string& access,
                   const std::string& value, bool mapped = false) {
  return "[" + name + "]\nParameterName=it\nDataType=" + type + "\nAccessType=" + access +
         "\nDefaultValue=" + value + (mapped ? "\nPDOMapping=1\n" : "\n");
}

std::string record(const std::string& index, const std::string& subs) {
  return "[" + index + "]\nParameterName=it\nObjectType=9\n" + object(index + "sub0", "5", "ro", subs);
}

std::string identity(const std::string& product, const std::string& revision) {
  return object("1000", "7", "ro", "0x00020192") + record("1018", "3") +
         object("1018sub1", "7", "ro", "0x55") + object("1018sub2", "7", "ro", product) +
         object("1018sub3", "7", "ro", revision);
}

/// A PDO of one object, with this COB-ID.
std::string pdo(unsigned number, bool input, const std::string& cob_id, const std::string& entry) {
  const std::string parameters = (input ? "180" : "140") + std::to_string(number - 1);
  const std::string mapping = (input ? "1A0" : "160") + std::to_string(number - 1);
  return record(parameters, "2") + object(parameters + "sub1", "7", "rw", cob_id) +
         object(parameters + "sub2", "5", "rw", "255") + record(mapping, "1") +
         object(mapping + "sub1", "7", "rw", entry);
}

const std::string kHeartbeat = object("1017", "6", "rw", "0");
const std::string kObjects = object("2000", "6", "ro", "0", true) + object("2001", "6", "rww", "0", true) +
                             object("2002", "5", "rww", "0", true);

/// A folder "eds", and what is written for these nodes.
struct Folder {
  std::map<std::string, std::string> files;
  std::vector<std::string> remarks;

  std::string text(const std::vector<FoundNode>& nodes) {
    remarks.clear();
    return network_text(
        nodes, "eds",
        [this](const std::string& path) -> std::optional<std::string> {
          if (path != "eds/") return files.at(path);
          std::string names;
          for (const auto& [name, content] : files)
            names += name.substr(4) + "\n";
          return names;
        },
        remarks);
  }
};

FoundNode found(std::uint8_t id, std::uint32_t product, std::uint32_t revision) {
  return {id, {0x20192, 0x55, product, revision, 9}, "a \"drive\"\n"};
}

}  // namespace

TEST_CASE(
    "a network file: each node with its EDS file, PDOs and heartbeat; one without a file is a comment") {
  Folder folder{{{"eds/drive.EDS", identity("7", "0x10000") + kHeartbeat + kObjects +
                                       pdo(1, true, "$NODEID+0x180", "0x20000010") +
                                       pdo(1, false, "$NODEID+0x200", "0x20010010")},
                 {"eds/readme.txt", "no EDS"}},
                {}};
  CHECK(folder.text({found(5, 7, 0x10000), found(6, 8, 0x10000)}) ==
        "\n[[node]]  # \"a \\\"drive\\\"\\u000A\", serial number 0x9\n"
        "id = 5\n"
        "eds = \"eds/drive.EDS\"\n"
        "device_type = 0x20192\n"
        "identity = [0x55, 0x7]\n"
        "heartbeat_ms = 1000\n"
        "pdos = [\n"
        "  { rpdo = 1 },  # 2001h:00\n"
        "  { tpdo = 1 },  # 2000h:00\n"
        "]\n"
        "# node 6 has no EDS file: device type 0x20192, vendor-ID 0x55, product 0x8, revision 0x10000, name "
        "\"a "
        "\\\"drive\\\"\\u000A\", serial number 0x9\n");
  CHECK(folder.remarks ==
        std::vector<std::string>{"node 6 has no EDS file: device type 0x20192, vendor-ID 0x55, "
                                 "product 0x8, revision 0x10000, name \"a \\\"drive\\\"\\u000A\", serial "
                                 "number 0x9"});
}

TEST_CASE("of several EDS files the one with the newest revision that is not above the device's is taken") {
  Folder folder{{{"eds/a.eds", identity("7", "0x10000")},
                 {"eds/b.eds", identity("7", "0x30000")},
                 {"eds/c.eds", identity("7", "0x20000")}},
                {}};
  const auto taken = [&](std::uint32_t revision) {
    const std::string text = folder.text({found(5, 7, revision)});
    CHECK(text.find("# " + folder.remarks.at(0) + "\n") == 0);
    const std::size_t at = text.find("eds = ");
    return text.substr(at + 11, 5) + " " + folder.remarks.at(0);
  };
  CHECK(taken(0x2FFFF) ==
        "c.eds node 5 has revision 0x2ffff, eds/c.eds is for 0x20000; also for it: eds/a.eds, eds/b.eds");
  CHECK(taken(0x30000) ==
        "b.eds node 5 has revision 0x30000, eds/b.eds is for 0x30000; also for it: eds/c.eds, eds/a.eds");
  CHECK(taken(0x00001) ==
        "a.eds node 5 has revision 0x1, eds/a.eds is for 0x10000; also for it: eds/c.eds, eds/b.eds");
  folder.files = {{"eds/b.eds", identity("7", "0x30000")}};
  CHECK(taken(0x10000) == "b.eds node 5 has revision 0x10000, eds/b.eds is for 0x30000");
  folder.text({found(5, 7, 0x30000)});
  CHECK(folder.remarks ==
        std::vector<std::string>{"node 5 has no heartbeat_ms: 1017h is not in the EDS, or read-only"});
}

TEST_CASE(
    "a file that names the product only in [DeviceInfo] matches; another type or vendor, or no identity, "
    "does not") {
  const std::string info = "[DeviceInfo]\nVendorNumber=0x55\nProductNumber=7\nRevisionNumber=2\n";
  Folder folder{{{"eds/a.eds", info + kHeartbeat}}, {}};
  const auto matches = [&](const FoundNode& node) {
    return folder.text({node}).find("eds = ") != std::string::npos;
  };
  CHECK(matches(found(5, 7, 2)));
  CHECK_FALSE(matches(found(5, 8, 2)));
  FoundNode other = found(5, 7, 2);
  other.identity[1] = 0x56;
  CHECK_FALSE(matches(other));
  folder.files = {{"eds/a.eds", identity("7", "1")}};
  folder.files = {{"eds/a.eds", "[DeviceInfo]\nProductNumber=8\n" + identity("7", "1")}};
  CHECK(matches(found(5, 7, 1)));
  other = found(5, 7, 1);
  other.identity[0] = 0x191;
  CHECK_FALSE(matches(other));
  folder.files = {{"eds/a.eds", kHeartbeat}};
  CHECK_FALSE(matches(found(5, 7, 2)));
  folder.files = {{"eds/a.eds", object("1000", "7", "ro", "0x00020192")}, {"eds/b.eds", identity("7", "1")}};
  CHECK(folder.text({found(5, 7, 0)}).find("eds = \"eds/b.eds\"") !=
        std::string::npos);  // the product is closer
  CHECK(folder.text({found(5, 8, 1)}).find("eds = \"eds/a.eds\"") != std::string::npos);
}

TEST_CASE("a PDO that the module would refuse is a comment with the reason") {
  Folder folder{
      {{"eds/a.eds", identity("7", "1") + kHeartbeat + kObjects + pdo(1, false, "0x205", "0x20010010") +
                         pdo(2, false, "0x305", "0x20010010") + pdo(3, false, "0x205", "0x20020008") +
                         pdo(1, true, "0x185", "0x20000010") + pdo(2, true, "0x285", "0x20000010") +
                         pdo(3, true, "0x80000385", "0x20000010")}},
      {}};
  const std::string text = folder.text({found(5, 7, 1)});
  CHECK(text.substr(text.find("pdos")) ==
        "pdos = [\n"
        "  { rpdo = 1 },  # 2001h:00\n"
        "  # { rpdo = 2 },  # RPDO 2: RPDO 1 has 2001h:00 already\n"
        "  # { rpdo = 3 },  # RPDO 3: node 5, RPDO 1 has CAN-ID 0x205 already: set another can_id\n"
        "  { tpdo = 1 },  # 2000h:00\n"
        "  { tpdo = 2 },  # 2000h:00\n"
        "]\n");
  CHECK(folder.remarks == std::vector<std::string>{
                              "node 5: RPDO 2: RPDO 1 has 2001h:00 already",
                              "node 5: RPDO 3: node 5, RPDO 1 has CAN-ID 0x205 already: set another can_id"});
}

TEST_CASE("EDS files that cannot be read are reported, a folder without any is a mistake") {
  Folder folder{{{"eds/a.eds", identity("7", "1") + kHeartbeat},
                 {"eds/b.eds",
                  "\x7F"
                  "ELF"}},
                {}};
  CHECK(folder.text({}) ==
        "# eds/b.eds:1: there is no object in it, no section like [1000]: is this an EDS or DCF?\n");
  CHECK(folder.remarks.size() == 1);
  folder.files.erase("eds/a.eds");
  CHECK_THROWS_AS(folder.text({}), cbcan::base::UsageError);
}
