// SPDX-License-Identifier: MIT
// What the summaries of the corpus do not show, and inputs that are too large for a corpus file.

#include "descriptions/eds_reader.hpp"
#include "descriptions/lexer.hpp"
#include "support/catch.hpp"

namespace cbcan::tests {

namespace {

descriptions::Result read(const std::string& text, std::optional<std::uint8_t> node_id = std::nullopt) {
  return descriptions::read(text, "test.eds", node_id);
}

std::string repeated(std::string_view part, std::size_t times) {
  std::string text;
  text.reserve(part.size() * times);
  for (std::size_t i = 0; i < times; ++i)
    text += part;
  return text;
}

const descriptions::Object& object(const descriptions::Result& result, std::uint16_t index, std::uint8_t sub) {
  const descriptions::Object* const found = result.device.find(index, sub);
  REQUIRE(found != nullptr);
  return *found;
}

}  // namespace

TEST_CASE("An XDD is refused with a word, with or without its XML declaration") {
  for (const char* text : {"<?xml version=\"1.0\"?>\n<ISO15745ProfileContainer/>",
                           "\xEF\xBB\xBF\r\n <ISO15745ProfileContainer>\n[1000]\n"}) {
    const auto result = cbcan::descriptions::read(text, "x.xdd", std::nullopt);
    CHECK(result.device.objects.empty());
    REQUIRE(result.diagnostics.size() >= 1);
    CHECK(to_string(result.diagnostics.front()) ==
          "x.xdd:1: an XML device description (CiA 311); export it as EDS, for example with CANopenEditor");
    CHECK(result.diagnostics.front().severity == cbcan::descriptions::Severity::kError);
  }
}

TEST_CASE("Warnings of one kind are one line: the first, how many more, and the last") {
  std::string text;
  for (int index = 2400; index > 2000; --index)  // 400 objects of three lines each, the last in line 1198
    text += "[" + std::to_string(index) + "]\nAccessType=rw\nDefaultValue=0\n";
  text += "[3000]\nDataType=0x99\nAccessType=rw\n[3001]\nDataType=0x98\nAccessType=rw\n";
  text += "[3002]\nDataType=5\nDefaultValue=1\nLowLimit=2\nParameterValue=x\n";
  text += "[3003]\nDataType=5\nDefaultValue=x\n";
  std::vector<std::string> lines;
  for (const auto& each : read(text).diagnostics)
    lines.push_back(to_string(each));
  CHECK(lines ==
        std::vector<std::string>{
            "test.eds:1: [2400] has no DataType: UNSIGNED32 is assumed; 399 more like this, "
            "up to line 1198",
            "test.eds:1202: DataType 0099h is unknown: OCTET_STRING is assumed",
            "test.eds:1205: DataType 0098h is unknown: OCTET_STRING is assumed",
            "test.eds:1207: [3002] has no AccessType: rw is assumed; 1 more like this, up to line 1212",
            "test.eds:1207: the value is below LowLimit: it is kept",
            "test.eds:1211: ParameterValue=\"x\" is no number of up to 64 bits: ignored",
            "test.eds:1214: DefaultValue=\"x\" is no number of up to 64 bits: ignored"});
}

TEST_CASE("CompactPDO is reported if PDOs that the file counts are not in it") {
  const std::string one = "[1400]\nDataType=5\nAccessType=rw\n[1600]\nDataType=5\nAccessType=rw\n";
  const auto warnings = [&one](const std::string& info) {
    std::string all;
    for (const auto& each : read("[DeviceInfo]\n" + info + one).diagnostics)
      all += to_string(each) + '\n';
    return all;
  };
  CHECK(warnings("CompactPDO=0x1F\n").empty());
  CHECK(warnings("CompactPDO=0x1F\nNrOfRXPDO=1\nNrOfTXPDO=0\n").empty());
  CHECK(warnings("CompactPDO=0\nNrOfRXPDO=4\nNrOfTXPDO=4\n").empty());
  CHECK(
      warnings("CompactPDO=3\nNrOfRXPDO=4\nNrOfTXPDO=2\n") ==
      "test.eds:3: NrOfRXPDO is 4, but the file has not all their objects: those of CompactPDO are not made\n"
      "test.eds:4: NrOfTXPDO is 2, but the file has not all their objects: those of CompactPDO are not "
      "made\n");
  CHECK(warnings("CompactPDO=3\nNrOfRXPDO=2\n[1401]\nDataType=5\nAccessType=rw\n") ==
        "test.eds:3: NrOfRXPDO is 2, but the file has not all their objects: those of CompactPDO are not "
        "made\n");
}

TEST_CASE("A DCF has a node ID, whichever way its section is spelled") {
  CHECK_FALSE(read("[DeviceInfo]\n").device.node_id);
  for (const char* name : {"DeviceComissioning", "DeviceCommissioning"})
    CHECK(read(std::string("[") + name + "]\nNodeID=0x20\n").device.node_id == 0x20);
}

TEST_CASE("The node ID given counts more than that of the file") {
  const std::string text =
      "[DeviceComissioning]\nNodeID=7\n[2000]\nDataType=0x0005\nAccessType=ro\nDefaultValue=$NODEID\n";
  CHECK(object(read(text), 0x2000, 0).value == std::vector<std::uint8_t>{7});
  CHECK(read(text).device.node_id == 7);
  const descriptions::Result result = read(text, std::uint8_t{9});
  CHECK(object(result, 0x2000, 0).value == std::vector<std::uint8_t>{9});
  CHECK(result.device.node_id == 9);
}

TEST_CASE("An object can hold what its type, its value or CBCAN_Size say") {
  const auto capacity = [](const std::string& keys) {
    return object(read("[2000]\n" + keys), 0x2000, 0).capacity;
  };
  CHECK(capacity("DataType=0x0007\n") == 4);
  CHECK(capacity("DataType=0x0018\n") == 5);
  CHECK(capacity("DataType=0x0009\n") == 64);
  CHECK(capacity("DataType=0x000A\nDefaultValue=0102\n") == 64);
  CHECK(capacity("DataType=0x0009\nDefaultValue=" + std::string(100, 'x')) == 100);
  CHECK(capacity("DataType=0x000F\n") == 1024);
  CHECK(capacity("DataType=0x0009\nCBCAN_Size=3\n") == 3);
  CHECK(capacity("DataType=0x000F\nCBCAN_Size=1000\n") == 1000);
  CHECK(capacity("DataType=0x0009\nDefaultValue=" + std::string(2'000'000, 'x')) == 1'048'576);
}

TEST_CASE("Elements of a run are found by any of their sub-indices") {
  const descriptions::Result result = read("[2000]\nObjectType=8\nDataType=5\nCompactSubObj=4\n");
  CHECK(object(result, 0x2000, 1).last_sub == 4);
  CHECK(result.device.find(0x2000, 4) == result.device.find(0x2000, 1));
  CHECK(result.device.find(0x2000, 5) == nullptr);
  CHECK(result.device.find(0x2001, 0) == nullptr);
  const descriptions::Result gap = read("[2000sub0]\nDataType=5\n[2000sub3]\nDataType=5\n");
  CHECK(gap.device.find(0x2000, 2) == nullptr);
  CHECK(object(gap, 0x2000, 3).first_sub == 3);
  CHECK(result.device.find(0x1FFF, 0) == nullptr);
}

TEST_CASE("Values of a device are bounded, whatever the file asks for") {
  std::string text;
  for (int index = 0x2000; index < 0x2020; ++index)
    text += "[" + std::to_string(index - 0x2000 + 2000) + "]\nObjectType=2\nCBCAN_Size=0x100000\n";
  const descriptions::Result result = read(text);
  // A DOMAIN of 1 MiB takes four more bytes for its length, so the 16th does not fit into 16 MiB.
  CHECK(result.device.objects.size() == 15);
  CHECK(std::count_if(result.diagnostics.begin(), result.diagnostics.end(), [](const descriptions::Diagnostic& found) {
          return found.severity == descriptions::Severity::kError;
        }) == 17);
}

TEST_CASE("A long stretch of anything is read to the end") {
  constexpr std::size_t kBytes = 200'000;
  for (const std::string_view part :
       {"\n", "\r", "x\n", "[1000]\n", "[a]\n", "a=1\n", "=", "[", "[[[", "$NODEID+", "\x80", ";", "[2000sub",
        "[2000]\nCompactSubObj=254\n", "\xEF\xBB\xBF", "BaudRate_1=1\n"}) {
    INFO(part);
    const descriptions::Result result = read("[DeviceInfo]\n" + repeated(part, kBytes / part.size()));
    CHECK(result.diagnostics.size() <= 501);
  }
}

TEST_CASE("Megabytes are read to the end") {
  CHECK(read(repeated(";=[]x0+\xFF\n", 200'000)).diagnostics.size() == 1);
  CHECK(read(repeated("\n", 1'000'000)).diagnostics.front().line == 1);
}

TEST_CASE("Thousands of objects and long values are read") {
  std::string text = "[2000]\nDataType=0x001B\nDefaultValue=" + repeated("$NODEID+", 100'000) + "1\n";
  for (int index = 0x3000; index < 0x5000; ++index) {
    char name[16];
    std::snprintf(name, sizeof name, "[%04X]\n", static_cast<unsigned>(index));
    text += std::string(name) + "ParameterName=x\nDataType=7\nAccessType=rw\nCompactSubObj=20\n";
  }
  const descriptions::Result result = read(text, std::uint8_t{1});
  CHECK(object(result, 0x2000, 0).value ==
        std::vector<std::uint8_t>{0xA1, 0x86, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00});  // 100,001
  CHECK(object(result, 0x4FFF, 20).first_sub == 1);
}

// ---- Lines and messages

namespace {

descriptions::Sections split(std::string_view text) {
  descriptions::Findings findings("test.eds");
  return descriptions::split_sections(text, findings);
}

}  // namespace

TEST_CASE("Text in messages is short and whole") {
  CHECK(descriptions::quoted("abc") == "\"abc\"");
  CHECK(descriptions::quoted(std::string(41, 'x')) == '"' + std::string(40, 'x') + "...\"");
  // The 40th byte is in the middle of a character.
  CHECK(descriptions::quoted(std::string(39, 'x') + "\xC3\xBC") == '"' + std::string(39, 'x') + "...\"");
  CHECK(descriptions::bracketed("1018sub1") == "[1018sub1]");
}

TEST_CASE("A section knows its name, its line and its keys") {
  const descriptions::Sections split_text = split("[A]\nx=1\n\n[B]\ny=\nz=a=b;c");
  const auto& sections = split_text.list;
  REQUIRE(sections.size() == 2);
  CHECK(sections[0].name == "A");
  CHECK(sections[0].line == 1);
  CHECK(sections[1].line == 4);
  REQUIRE(sections[0].find("X") != nullptr);
  CHECK(sections[0].find("X")->value == "1");
  CHECK(sections[0].find("X")->line == 2);
  CHECK(sections[1].find("y") == nullptr);
  CHECK(sections[1].find("z")->value == "a=b;c");
}

TEST_CASE("A diagnostic says file, line and message") {
  descriptions::Findings findings("pump.eds");
  findings.warning(12, "second");
  findings.error(3, "first");
  const auto diagnostics = findings.take();
  REQUIRE(diagnostics.size() == 2);
  CHECK(to_string(diagnostics[0]) == "pump.eds:3: first");
  CHECK(diagnostics[0].severity == descriptions::Severity::kError);
  CHECK(to_string(diagnostics[1]) == "pump.eds:12: second");
}

TEST_CASE("Garbage does not make endless diagnostics") {
  descriptions::Findings findings("noise.eds");
  for (std::size_t line = 1; line <= 1000; ++line)
    findings.error(line, "noise");
  const auto diagnostics = findings.take();
  REQUIRE(diagnostics.size() == 501);
  CHECK(diagnostics.back().message == "and 500 more");
}

}  // namespace cbcan::tests
