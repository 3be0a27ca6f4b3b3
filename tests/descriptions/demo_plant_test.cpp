// SPDX-License-Identifier: MIT
// The files of the demo plant: correct by CiA 306, and with the objects that the plant needs.

#include "corpus.hpp"
#include "descriptions/dictionary_image.hpp"
#include "support/catch.hpp"

namespace cbcan::tests {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kLongestLine = 255;  // CiA 306, 4.1

struct Node {
  Node(const std::string& file, std::uint8_t node_id)
      : result(descriptions::read(test::source_file("plants/demo/" + file), file, node_id)),
        image(descriptions::dictionary_image(result.device)),
        dictionary(image.entries, image.values, nullptr, image.limits) {}

  std::uint64_t get(std::uint16_t index, std::uint8_t sub) const { return dictionary.get(index, sub); }

  struct Value {
    std::uint16_t index;
    std::uint8_t sub;
    std::uint64_t value;
  };
  void shows(std::initializer_list<Value> values) const {
    for (const Value& each : values) {
      INFO("object " << std::hex << each.index << " sub " << int{each.sub});
      CHECK(get(each.index, each.sub) == each.value);
    }
  }

  std::size_t size(int index) const {
    Bytes bytes(2000);
    std::size_t size = 0;
    REQUIRE(dictionary.read(static_cast<std::uint16_t>(index), 0, bytes, size, 0) == AbortCode::kNone);
    return size;
  }

  descriptions::Result result;
  descriptions::DictionaryImage image;
  ObjectDictionary dictionary;
};

}  // namespace

TEST_CASE("The files of the demo plant are read without a word") {
  for (const char* file : {"io_module.eds", "pressure_transducer.eds", "generic.eds"}) {
    INFO(file);
    const Node node(file, 1);
    CHECK(node.result.diagnostics.empty());
    std::istringstream lines(test::source_file("plants/demo/" + std::string(file)));
    for (std::string line; std::getline(lines, line);)
      CHECK(line.size() <= kLongestLine);
  }
}

TEST_CASE("Every node of the demo plant has the objects that CiA 301 asks for") {
  for (const char* file : {"io_module.eds", "pressure_transducer.eds", "generic.eds"}) {
    INFO(file);
    const Node node(file, 0x42);
    for (const int index : {0x1000, 0x1001, 0x1018})
      CHECK(node.result.device.find(static_cast<std::uint16_t>(index), 0) != nullptr);
    node.shows({{0x1014, 0, 0xC2}, {0x1200, 1, 0x642}, {0x1200, 2, 0x5C2}, {0x1018, 0, 4}});
  }
}

TEST_CASE("What the default mappings name may be mapped that way") {
  const auto check = [](const Node& node, std::uint16_t first, std::uint16_t last, std::uint8_t flag) {
    for (std::uint16_t index = first; index <= last; ++index) {
      REQUIRE(node.get(index, 0) > 0);
      for (unsigned sub = 1; sub <= node.get(index, 0); ++sub) {
        const std::uint64_t mapped = node.get(index, static_cast<std::uint8_t>(sub));
        ObjectEntry entry{};
        REQUIRE(node.dictionary.find(static_cast<std::uint16_t>(mapped >> 16),
                                     static_cast<std::uint8_t>(mapped >> 8), entry) == AbortCode::kNone);
        CHECK(entry.has(flag));
        CHECK(entry.capacity == (mapped & 0xFF) / 8);
      }
    }
  };
  const Node io_module("io_module.eds", 0x42);
  check(io_module, 0x1600, 0x1601, ObjectFlags::kMapRpdo);
  check(io_module, 0x1A00, 0x1A01, ObjectFlags::kMapTpdo);
  check(Node("pressure_transducer.eds", 1), 0x1A00, 0x1A00, ObjectFlags::kMapTpdo);
}

TEST_CASE("The generic node has objects of every size") {
  Node node("generic.eds", 0x20);
  for (const std::uint16_t size : std::initializer_list<std::uint16_t>{1, 2, 3, 4, 5, 8, 14, 127, 128})
    CHECK(node.size(0x2000 + size) == size);
  CHECK(node.size(0x2100) == 1000);
  CHECK(node.dictionary.write(0x2080, 0, Bytes(129), 0) == AbortCode::kParameterLength);
  CHECK(node.dictionary.write(0x2004, 0, Bytes(3), 0) == AbortCode::kObjectLength);
  CHECK(node.dictionary.write(0x2200, 0, Bytes(4), 0) == AbortCode::kReadOnly);
  Bytes out(4);
  std::size_t size = 0;
  CHECK(node.dictionary.read(0x2201, 0, out, size, 0) == AbortCode::kWriteOnly);
  CHECK(node.dictionary.write(0x2201, 0, Bytes(4), 0) == AbortCode::kNone);
  CHECK(node.dictionary.write(0x2202, 0, Bytes{0xE9, 0x03}, 0) == AbortCode::kValueHigh);  // 1001
  CHECK(node.dictionary.write(0x2202, 0, Bytes{0x17, 0xFC}, 0) == AbortCode::kValueLow);   // -1001
  CHECK(node.dictionary.write(0x2202, 0, Bytes{0x18, 0xFC}, 0) == AbortCode::kNone);       // -1000
}

}  // namespace cbcan::tests
