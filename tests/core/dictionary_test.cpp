// SPDX-License-Identifier: MIT

#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "support/catch.hpp"

using namespace cbcan;
using Flags = cbcan::ObjectFlags;

namespace {

constexpr std::array kRows{
    ObjectEntry{0x2000, 0, 0, DataType::kUnsigned8, 0, Flags::kRead, 0, 1},
    ObjectEntry{0x2000, 1, 200, DataType::kInteger16, 0, Flags::kReadWrite | Flags::kLimited, 1, 2},
    ObjectEntry{0x2001, 5, 5, DataType::kVisibleString, 0, Flags::kReadWrite | Flags::kVariable, 405, 8},
    ObjectEntry{0x2003, 0, 0, DataType::kInteger64, 0, Flags::kReadWrite | Flags::kLimited, 413, 8},
};
constexpr std::array kRowLimits{
    cbcan::ObjectLimits{0x2000, 7, -100, 50},
    cbcan::ObjectLimits{0x2003, 0, -1, 1},
};

struct Fixture {
  std::array<std::uint8_t, 421> values{};
  ObjectDictionary dictionary{kRows, values, nullptr, kRowLimits};

  AbortCode write(std::uint16_t index, std::uint8_t sub, std::initializer_list<std::uint8_t> bytes) {
    return dictionary.write(index, sub, std::span(bytes.begin(), bytes.size()), 0);
  }
};

}  // namespace

TEST_CASE("Lookup: no object, no sub-index, runs of sub-indices") {
  Fixture fixture;
  ObjectEntry entry{};
  CHECK(fixture.dictionary.find(0x2000, 0, entry) == AbortCode::kNone);
  CHECK(entry.capacity == 1);
  CHECK(fixture.dictionary.find(0x2000, 200, entry) == AbortCode::kNone);
  CHECK(entry.capacity == 2);
  CHECK(fixture.dictionary.find(0x2000, 201, entry) == AbortCode::kNoSubIndex);
  CHECK(entry.capacity == 2);  // unchanged
  CHECK(fixture.dictionary.find(0x2001, 4, entry) == AbortCode::kNoSubIndex);
  CHECK(fixture.dictionary.find(0x2001, 6, entry) == AbortCode::kNoSubIndex);
  CHECK(fixture.dictionary.find(0x2002, 0, entry) == AbortCode::kNoObject);
  CHECK(fixture.dictionary.find(0x1FFF, 255, entry) == AbortCode::kNoObject);
  CHECK(fixture.dictionary.find(0x2004, 0, entry) == AbortCode::kNoObject);
  CHECK_FALSE(fixture.dictionary.set(0x2002, 0, 1));
  CHECK_FALSE(fixture.dictionary.set(0x2001, 5, 1));  // it has no bytes yet
}

TEST_CASE("Sub-index 0 of a counted array says what the last one is") {
  constexpr std::array entries{
      ObjectEntry{0x2000, 1, 3, DataType::kUnsigned16, 1, Flags::kReadWrite | Flags::kCounted, 0, 2}};
  std::array<std::uint8_t, 12> values{};
  ObjectDictionary dictionary{entries, values, nullptr};
  std::array<std::uint8_t, 2> out{};
  std::size_t size = 0;
  CHECK(dictionary.read(0x2001, 0, out, size, 0) == AbortCode::kNone);
  CHECK(size == 1);
  CHECK(out[0] == 3);
  CHECK(dictionary.read(0x2001, 0, {}, size, 0) == AbortCode::kReadLength);
  ObjectEntry entry{};
  CHECK(dictionary.find(0x2001, 4, entry) == AbortCode::kNoSubIndex);
  CHECK(dictionary.find(0x2002, 0, entry) == AbortCode::kNoObject);
}

TEST_CASE("Elements of a run do not touch each other") {
  Fixture fixture;
  CHECK(fixture.write(0x2000, 1, {0x11, 0x22}) == AbortCode::kNone);
  CHECK(fixture.write(0x2000, 200, {0x33, 0x44}) == AbortCode::kNone);
  CHECK(fixture.dictionary.get(0x2000, 1) == 0x2211);
  CHECK(fixture.dictionary.get(0x2000, 2) == 0);
  CHECK(fixture.dictionary.get(0x2000, 199) == 0);
  CHECK(fixture.dictionary.get(0x2000, 200) == 0x4433);
  CHECK(fixture.values[399] == 0x33);
}

TEST_CASE("Limits of signed values") {
  Fixture fixture;
  CHECK(fixture.write(0x2000, 7, {0x9C, 0xFF}) == AbortCode::kNone);      // -100
  CHECK(fixture.write(0x2000, 7, {0x9B, 0xFF}) == AbortCode::kValueLow);  // -101
  CHECK(fixture.write(0x2000, 7, {50, 0}) == AbortCode::kNone);
  CHECK(fixture.write(0x2000, 7, {51, 0}) == AbortCode::kValueHigh);
  CHECK(fixture.write(0x2000, 8, {51, 0}) == AbortCode::kNone);
  CHECK(fixture.write(0x2003, 0, {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}) == AbortCode::kNone);
  CHECK(fixture.write(0x2003, 0, {0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}) == AbortCode::kValueLow);
}

namespace {

/// Records of a U8 and two U16 at 1800h..180Fh; process data at A000h, as bytes and as bits.
constexpr std::array kRuns{
    ObjectEntry{0x1000, 0, 0, DataType::kUnsigned8, 0, Flags::kReadWrite, 0, 1},
    ObjectEntry{0x1800, 0, 0, DataType::kUnsigned8, 15, Flags::kReadWrite, 1, 1},
    ObjectEntry{0x1800, 3, 4, DataType::kUnsigned16, 15, Flags::kReadWrite, 17, 2},
    ObjectEntry{0xA000, 1, 4, DataType::kUnsigned8, 0, Flags::kReadWrite | Flags::kProcess, 2, 1},
    ObjectEntry{0xA080, 1, 10, DataType::kBoolean, 1, Flags::kReadWrite | Flags::kProcess | Flags::kPacked,
                16, 1},
};

}  // namespace

TEST_CASE("Runs of indices: what is found is one of its index alone") {
  std::array<std::uint8_t, 81> values{};
  std::array<std::uint8_t, 6> process{};
  const ObjectDictionary dictionary{kRuns, values, nullptr, {}, process};
  ObjectEntry entry{};
  CHECK(dictionary.find(0x1807, 4, entry) == AbortCode::kNone);
  CHECK(entry.index == 0x1807);
  CHECK(entry.more_indices == 0);
  CHECK(entry.first_sub == 3);
  CHECK(dictionary.find(0x17FF, 0, entry) == AbortCode::kNoObject);
  CHECK(dictionary.find(0x1810, 0, entry) == AbortCode::kNoObject);
  CHECK(dictionary.find(0x1808, 1, entry) == AbortCode::kNoSubIndex);
  CHECK(dictionary.find(0x1808, 5, entry) == AbortCode::kNoSubIndex);
  CHECK(dictionary.find(0xA082, 1, entry) == AbortCode::kNoObject);
}

TEST_CASE("Power-on values: behind their end everything becomes 0") {
  std::array<std::uint8_t, 81> values{};
  values.fill(0x77);
  const std::array<std::uint8_t, 17> power_on{9};
  restore_values(kRuns, power_on, values, 0, 0xFFFF);
  CHECK(values[0] == 9);
  CHECK(std::count(values.begin(), values.end(), 0) == 80);
}
