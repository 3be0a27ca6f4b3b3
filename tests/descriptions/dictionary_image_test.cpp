// SPDX-License-Identifier: MIT
#include "descriptions/dictionary_image.hpp"

#include "descriptions/eds_reader.hpp"
#include "support/catch.hpp"

namespace cbcan::tests {

namespace {

using Bytes = std::vector<std::uint8_t>;

descriptions::DictionaryImage image_of(const std::string& text) {
  return descriptions::dictionary_image(descriptions::read(text, "test.eds", std::uint8_t{5}).device);
}

std::string variable(const std::string& index, const std::string& type, const std::string& access,
                     const std::string& more) {
  return "[" + index + "]\nParameterName=x\nDataType=" + type + "\nAccessType=" + access + "\n" + more + "\n";
}

struct Device {
  explicit Device(const std::string& text)
      : image(image_of(text)), dictionary(image.entries, image.values, nullptr, image.limits) {}

  Bytes read(std::uint16_t index, std::uint8_t sub) const {
    Bytes bytes(1024);
    std::size_t size = 0;
    REQUIRE(dictionary.read(index, sub, bytes, size, 0) == AbortCode::kNone);
    bytes.resize(size);
    return bytes;
  }

  AbortCode write(std::uint16_t index, std::uint8_t sub, const Bytes& bytes) {
    return dictionary.write(index, sub, bytes, 0);
  }

  descriptions::DictionaryImage image;
  ObjectDictionary dictionary;
};

}  // namespace

TEST_CASE("Values follow one another, strings with their length") {
  const descriptions::DictionaryImage image = image_of(variable("2000", "6", "rw", "DefaultValue=0x1234") +
                                              variable("2001", "9", "rw", "DefaultValue=Hi\nCBCAN_Size=4") +
                                              variable("2002", "5", "ro", "DefaultValue=7"));
  CHECK(image.values == Bytes{0x34, 0x12, 2, 0, 0, 0, 'H', 'i', 0, 0, 7});
  REQUIRE(image.entries.size() == 3);
  CHECK(image.entries[0].offset == 0);
  CHECK(image.entries[0].capacity == 2);
  CHECK(image.entries[0].flags == ObjectFlags::kReadWrite);
  CHECK(image.entries[1].offset == 6);
  CHECK(image.entries[1].capacity == 4);
  CHECK(image.entries[1].flags == (ObjectFlags::kReadWrite | ObjectFlags::kVariable));
  CHECK(image.entries[2].offset == 10);
  CHECK(image.entries[2].flags == ObjectFlags::kRead);
}

TEST_CASE("A compact array is one entry") {
  Device device("[2000]\nObjectType=8\nDataType=6\nDefaultValue=0x0102\nCompactSubObj=3\nLowLimit=1\n");
  REQUIRE(device.image.entries.size() == 2);
  CHECK(device.image.values == Bytes{3, 2, 1, 2, 1, 2, 1});
  CHECK(device.image.limits.size() == 3);
  CHECK(device.read(0x2000, 0) == Bytes{3});
  CHECK(device.write(0x2000, 2, {0x34, 0x12}) == AbortCode::kNone);
  CHECK(device.read(0x2000, 1) == Bytes{2, 1});
  CHECK(device.read(0x2000, 2) == Bytes{0x34, 0x12});
  CHECK(device.write(0x2000, 3, {0, 0}) == AbortCode::kValueLow);
  CHECK(device.write(0x2000, 0, {2}) == AbortCode::kReadOnly);
}

TEST_CASE("A compact array of strings keeps a length for each") {
  Device device("[2000]\nObjectType=8\nDataType=9\nDefaultValue=ab\nCBCAN_Size=3\nCompactSubObj=2\n");
  CHECK(device.image.values == Bytes{2, 2, 0, 0, 0, 'a', 'b', 0, 2, 0, 0, 0, 'a', 'b', 0});
  CHECK(device.write(0x2000, 1, {'x'}) == AbortCode::kNone);
  CHECK(device.read(0x2000, 1) == Bytes{'x'});
  CHECK(device.read(0x2000, 2) == Bytes{'a', 'b'});
  CHECK(device.write(0x2000, 2, {'x', 'y', 'z', '!'}) == AbortCode::kParameterLength);
}

TEST_CASE("Access rights reach SDO and PDO") {
  const auto flags = [](const char* access, int pdo_mapping) {
    const auto image =
        image_of(variable("2000", "5", access, "DefaultValue=0\nPDOMapping=" + std::to_string(pdo_mapping)));
    REQUIRE(image.entries.size() == 1);
    return image.entries[0].flags;
  };
  CHECK(flags("ro", 0) == 0x01);
  CHECK(flags("const", 0) == 0x01);
  CHECK(flags("wo", 0) == 0x02);
  CHECK(flags("rw", 0) == 0x03);
  CHECK(flags("rwr", 0) == 0x03);
  CHECK(flags("rww", 0) == 0x03);
  CHECK(flags("ro", 1) == 0x81);
  CHECK(flags("wo", 1) == 0x42);
  CHECK(flags("rw", 1) == 0xC3);
  CHECK(flags("rwr", 1) == 0x83);
  CHECK(flags("rww", 1) == 0x43);
}

TEST_CASE("What the file gives no value is marked, one by one") {
  const auto unset = [](const std::string& text) {
    std::string marks;
    for (const ObjectEntry& entry : image_of(text).entries)
      marks += entry.has(ObjectFlags::kUnset) ? 'u' : '-';
    return marks;
  };
  CHECK(unset(variable("2000", "5", "rw", "") + variable("2001", "5", "rw", "DefaultValue=") +
              variable("2002", "5", "rw", "DefaultValue=0") + variable("2003", "5", "rw", "DefaultValue=x") +
              variable("2004", "5", "rw", "ParameterValue=1")) == "uu-u-");
  CHECK(unset("[2000]\nObjectType=8\nDataType=6\nCompactSubObj=3\n[2000Value]\nNrOfEntries=1\n2=7\n") ==
        "-u-u");
}

TEST_CASE("Limits hold, both ends allowed") {
  Device device(variable("2000", "2", "rw", "LowLimit=0x80\nHighLimit=10") +
                variable("2001", "5", "rw", "LowLimit=0x10\nHighLimit=0xFF") +
                variable("2002", "0x1B", "rw", "HighLimit=0x8000000000000000"));
  CHECK(device.write(0x2000, 0, {0x80}) == AbortCode::kNone);
  CHECK(device.write(0x2000, 0, {0x0A}) == AbortCode::kNone);
  CHECK(device.write(0x2000, 0, {0x0B}) == AbortCode::kValueHigh);
  CHECK(device.write(0x2001, 0, {0x0F}) == AbortCode::kValueLow);
  CHECK(device.write(0x2001, 0, {0x10}) == AbortCode::kNone);
  CHECK(device.write(0x2001, 0, {0xFF}) == AbortCode::kNone);
  CHECK(device.write(0x2002, 0, {0, 0, 0, 0, 0, 0, 0, 0x80}) == AbortCode::kNone);
  CHECK(device.write(0x2002, 0, {1, 0, 0, 0, 0, 0, 0, 0x80}) == AbortCode::kValueHigh);
}

TEST_CASE("Limits as wide as the type take no row") {
  const descriptions::DictionaryImage image = image_of(
      variable("2000", "2", "rw", "LowLimit=0x80\nHighLimit=0x7F") +
      variable("2001", "0x1B", "rw", "LowLimit=0\nHighLimit=0xFFFFFFFFFFFFFFFF") +
      variable("2002", "0x15", "rw", "LowLimit=0x8000000000000000") + variable("2003", "7", "rw", ""));
  CHECK(image.limits.empty());
  for (const ObjectEntry& entry : image.entries)
    CHECK_FALSE(entry.has(ObjectFlags::kLimited));
}

TEST_CASE("Data types below 1000h are no objects of a dictionary") {
  const descriptions::DictionaryImage image =
      image_of("[0005]\nObjectType=5\nDataType=5\n" + variable("1000", "7", "ro", "DefaultValue=1"));
  REQUIRE(image.entries.size() == 1);
  CHECK(image.entries[0].index == 0x1000);
  CHECK(image.values == Bytes{1, 0, 0, 0});
}

TEST_CASE("Values with $NODEID in them follow the node ID, all others stay") {
  const std::string text = variable("1014", "7", "rw", "DefaultValue=$NODEID+0x80") +
                           variable("1015", "6", "rw", "DefaultValue=5") +
                           variable("1016", "9", "rw", "DefaultValue=$NODEID\nCBCAN_Size=7") +
                           variable("2000", "5", "rw", "DefaultValue= 0x10 + $nodeid") +
                           variable("2001", "0x1B", "rw", "DefaultValue=$NODEID") +
                           variable("2002", "4", "rw", "DefaultValue=$NODEID+$NODEID+0x300");
  descriptions::DictionaryImage image = descriptions::dictionary_image(descriptions::read(text, "test.eds", std::nullopt).device);
  const Bytes without{0x80, 0,   0,    0, 5, 0, 7, 0, 0, 0, '$', 'N', 'O', 'D', 'E',
                      'I',  'D', 0x10, 0, 0, 0, 0, 0, 0, 0, 0,   0,   3,   0,   0};
  CHECK(image.values == without);
  change_node_id(image.values, image.node_id_values, 0, 5);
  CHECK(image.values == Bytes{0x85, 0,   0,    0, 5, 0, 7, 0, 0, 0, '$', 'N',  'O', 'D', 'E',
                              'I',  'D', 0x15, 5, 0, 0, 0, 0, 0, 0, 0,   0x0A, 3,   0,   0});
  CHECK(image.values == image_of(text).values);
  change_node_id(image.values, image.node_id_values, 5, 127);
  CHECK(image.values == Bytes{0xFF, 0,   0,    0,   5, 0, 7, 0, 0, 0, '$', 'N',  'O', 'D', 'E',
                              'I',  'D', 0x8F, 127, 0, 0, 0, 0, 0, 0, 0,   0xFE, 3,   0,   0});
  change_node_id(image.values, image.node_id_values, 127, 0);
  CHECK(image.values == without);
}

TEST_CASE("Values that follow the node ID wrap round within their size") {
  descriptions::DictionaryImage image =
      descriptions::dictionary_image(descriptions::read(variable("2000", "5", "rw", "DefaultValue=0xFE+$NODEID") +
                                          variable("2001", "5", "rw", "DefaultValue=1"),
                                      "test.eds", std::nullopt)
                                .device);
  change_node_id(image.values, image.node_id_values, 0, 3);
  CHECK(image.values == Bytes{0x01, 0x01});
  change_node_id(image.values, image.node_id_values, 3, 1);
  CHECK(image.values == Bytes{0xFF, 0x01});
}

TEST_CASE("Each element of a compact array follows the node ID, but those with a value of their own") {
  Device device(
      "[2000]\nObjectType=8\nDataType=6\nDefaultValue=$NODEID+0x200\nCompactSubObj=3\n"
      "[2000Value]\nNrOfEntries=1\n2=0x0777\n");
  CHECK(device.image.values == Bytes{3, 0x05, 2, 0x77, 7, 0x05, 2});
  change_node_id(device.image.values, device.image.node_id_values, 5, 0x42);
  CHECK(device.image.values == Bytes{3, 0x42, 2, 0x77, 7, 0x42, 2});
}

TEST_CASE("A ParameterValue decides whether a value follows the node ID; one that cannot be read does not") {
  descriptions::DictionaryImage image =
      image_of(variable("2000", "5", "rw", "DefaultValue=$NODEID\nParameterValue=9") +
               variable("2001", "5", "rw", "DefaultValue=9\nParameterValue=$NODEID") +
               variable("2002", "5", "rw", "DefaultValue=9\nParameterValue=0x100+$NODEID"));
  CHECK(image.values == Bytes{9, 5, 9});
  change_node_id(image.values, image.node_id_values, 5, 6);
  CHECK(image.values == Bytes{9, 6, 9});
}

TEST_CASE("A device without objects has an empty dictionary") {
  const Device device("");
  ObjectEntry entry{};
  CHECK(device.dictionary.find(0x1000, 0, entry) == AbortCode::kNoObject);
}

TEST_CASE("FFFFh and sub-index FFh, the last there are, are like all others") {
  Device device("[FFFF]\nParameterName=x\nObjectType=8\nSubNumber=2\n" + variable("FFFFsub0", "5", "ro", "") +
                variable("FFFFsubFF", "5", "rw", "DefaultValue=7\nHighLimit=9"));
  CHECK(device.read(0xFFFF, 0) == Bytes{0xFF});
  CHECK(device.read(0xFFFF, 0xFF) == Bytes{7});
  CHECK(device.write(0xFFFF, 0xFF, {10}) == AbortCode::kValueHigh);
}

}  // namespace cbcan::tests
