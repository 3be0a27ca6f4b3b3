// SPDX-License-Identifier: MIT
// Plans from DCF files.
#include "descriptions/network_file.hpp"

#include "base/text.hpp"
#include "support/catch.hpp"

using namespace cbcan::descriptions;

namespace {

std::string text_of(const std::vector<PlannedObject>& objects) {
  std::string text;
  for (const PlannedObject& object : objects)
    text += cbcan::base::hex(object.index, 4) + ":" + cbcan::base::hex(object.sub, 2) + " " +
            cbcan::base::hex(object.value, " ") + "\n";
  return text;
}

/// "1401sub1 7 rw DefaultValue=1": a section with DataType, AccessType and value.
std::string section(const std::string& name, int type, const std::string& access, const std::string& value) {
  return "[" + name + "]\nParameterName=it\nDataType=" + std::to_string(type) + "\nAccessType=" + access +
         "\n" + value + "\n";
}

std::string record(const std::string& name) {
  return "[" + name + "]\nParameterName=it\nObjectType=9\n";
}

}  // namespace

TEST_CASE("a DCF: identity, ParameterValues, and PDOs in the order of CiA 301") {
  const std::string dcf =
      "[DeviceComissioning]\nNodeID=5\n" + section("1000", 7, "ro", "DefaultValue=0x00020192") +
      section("1005", 7, "rw", "DefaultValue=0x80") + section("1010", 7, "rw", "ParameterValue=1") +
      record("1018") + section("1018sub0", 5, "ro", "DefaultValue=2") +
      section("1018sub1", 7, "ro", "DefaultValue=0x55") + section("1018sub2", 7, "ro", "DefaultValue=0") +
      record("1401") + section("1401sub0", 5, "ro", "DefaultValue=2") +
      section("1401sub1", 7, "rw", "DefaultValue=$NODEID+0x300") +
      section("1401sub2", 5, "rw", "ParameterValue=1") +  //
      record("1601") + section("1601sub0", 5, "rw", "ParameterValue=1") +
      section("1601sub1", 7, "rw", "ParameterValue=0x20010008") +
      section("1601sub2", 7, "rw", "ParameterValue=0") + record("1402") +
      section("1402sub1", 7, "rw", "DefaultValue=$NODEID+0x400") +  // its mapping is set alone
      section("1402sub2", 5, "rw", "DefaultValue=255") + record("1602") +
      section("1602sub0", 5, "rw", "DefaultValue=1") +
      section("1602sub1", 7, "rw", "ParameterValue=0x20020010") +
      section("2001", 6, "rw", "DefaultValue=1\nParameterValue=0x1234") +
      section("2002", 6, "const", "ParameterValue=2") +
      section("2003", 5, "rw", "DefaultValue=9\nObjectType=8\nCompactSubObj=2") +
      "[2003Value]\nNrOfEntries=1\n2=7\n";
  std::vector<std::string> remarks;
  const PlannedNode node = parse_dcf(dcf, "drive.dcf", remarks);
  CHECK(node.id == 5);
  CHECK(remarks == std::vector<std::string>{
                       "drive.dcf:72: 1402h has no sub-index 0: a read-only one that says 2 is assumed"});
  CHECK(text_of(node.identity) == "1000:00 92 01 02 00\n1018:01 55 00 00 00\n");
  CHECK(text_of(node.objects) ==
        "2001:00 34 12\n"
        "2003:02 07\n"
        "1401:01 05 03 00 80\n"
        "1401:02 01\n"
        "1601:00 00\n"
        "1601:01 08 00 01 20\n"
        "1601:00 01\n"
        "1401:01 05 03 00 00\n"
        "1402:01 05 04 00 80\n"
        "1602:00 00\n"
        "1602:01 10 00 02 20\n"
        "1602:00 01\n"
        "1402:01 05 04 00 00\n");
}

TEST_CASE("a PDO that stays invalid, and PDOs of which not all is written") {
  using Objects = std::vector<PlannedObject>;
  CHECK(text_of(in_writing_order(
            Objects{{0x1800, 1, {1, 0, 0, 0x80}}, {0x1A00, 0, {0}}, {0x1A00, 1, {0, 0, 0, 0}}})) ==
        "1800:01 01 00 00 80\n1A00:00 00\n");
  CHECK(text_of(in_writing_order(Objects{{0x1400, 2, {255}}, {0x2001, 0, {1}}})) ==
        "2001:00 01\n1400:02 FF\n");
  CHECK(text_of(in_writing_order(Objects{{0x1BFF, 1, {1, 2, 3, 4}}})) == "1BFF:01 01 02 03 04\n");
}

TEST_CASE("what is wrong with a DCF, and where") {
  const std::string node = "[DeviceComissioning]\nNodeID=5\n";
  const auto [text, wrong] = GENERATE_COPY(table<std::string, std::string>({
      {"", "a.dcf:1: there is no object in it, no section like [1000]: is this an EDS or DCF?"},
      {std::string("\0\xFF\n[\x01", 5),
       "a.dcf:1: there is no object in it, no section like [1000]: is this an EDS or DCF?"},
      {"<?xml version=\"1.0\"?>",
       "a.dcf:1: an XML device description (CiA 311); export it as EDS, for example with CANopenEditor"},
      {section("2001", 5, "rw", ""), "a.dcf:1: there is no NodeID in [DeviceComissioning]: is this a DCF?"},
      {"[DeviceComissioning]\nNodeID=128\n" + section("2001", 5, "rw", ""),
       "a.dcf:1: there is no NodeID in [DeviceComissioning]: is this a DCF?"},
      {node + section("2001", 5, "rw", "ParameterValue=300"),
       "a.dcf:7: ParameterValue=\"300\" is no UNSIGNED8"},
      {node + section("2001", 9, "rw", "ParameterValue=" + std::string(65'001, 'x')),
       "a.dcf:3: 2001h:00 has 65001 bytes: must be 1..65000"},
  }));
  std::vector<std::string> remarks;
  CHECK_THROWS_WITH(parse_dcf(text, "a.dcf", remarks), wrong);
}
