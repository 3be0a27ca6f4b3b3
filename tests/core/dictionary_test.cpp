// SPDX-License-Identifier: MIT

#include <array>

#include "canopen/object_dictionary.hpp"
#include "support/catch.hpp"

using cbcan::AbortCode;
using cbcan::DataType;
using cbcan::ObjectDictionary;
using cbcan::ObjectEntry;
using Flags = cbcan::ObjectFlags;

namespace {

constexpr std::array kEntries{
    ObjectEntry{0x2000, 0, 0, DataType::kUnsigned8, Flags::kRead, 0, 1},
    ObjectEntry{0x2000, 1, 200, DataType::kInteger16, Flags::kReadWrite | Flags::kLimited, 1, 2},
    ObjectEntry{0x2001, 5, 5, DataType::kVisibleString, Flags::kReadWrite | Flags::kVariable, 405, 8},
    ObjectEntry{0x2003, 0, 0, DataType::kInteger64, Flags::kReadWrite | Flags::kLimited, 413, 8},
};
constexpr std::array kLimits{
    cbcan::ObjectLimits{0x2000, 7, -100, 50},
    cbcan::ObjectLimits{0x2003, 0, -1, 1},
};

struct Fixture {
  std::array<std::uint8_t, 421> values{};
  ObjectDictionary dictionary{kEntries, values, nullptr, kLimits};

  AbortCode write(std::uint16_t index, std::uint8_t sub, std::initializer_list<std::uint8_t> bytes) {
    return dictionary.write(index, sub, std::span(bytes.begin(), bytes.size()), 0);
  }
};

}  // namespace

TEST_CASE("Lookup: no object, no sub-index, runs of sub-indices") {
  Fixture fixture;
  const ObjectEntry* entry = nullptr;
  CHECK(fixture.dictionary.find(0x2000, 0, entry) == AbortCode::kNone);
  CHECK(entry == &kEntries[0]);
  CHECK(fixture.dictionary.find(0x2000, 200, entry) == AbortCode::kNone);
  CHECK(entry == &kEntries[1]);
  CHECK(fixture.dictionary.find(0x2000, 201, entry) == AbortCode::kNoSubIndex);
  CHECK(entry == nullptr);
  CHECK(fixture.dictionary.find(0x2001, 4, entry) == AbortCode::kNoSubIndex);
  CHECK(fixture.dictionary.find(0x2001, 6, entry) == AbortCode::kNoSubIndex);
  CHECK(fixture.dictionary.find(0x2002, 0, entry) == AbortCode::kNoObject);
  CHECK(fixture.dictionary.find(0x1FFF, 255, entry) == AbortCode::kNoObject);
  CHECK(fixture.dictionary.find(0x2004, 0, entry) == AbortCode::kNoObject);
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

TEST_CASE("Variable length: what was written is what is read, up to the capacity") {
  Fixture fixture;
  std::array<std::uint8_t, 16> out{};
  std::size_t size = 99;
  CHECK(fixture.dictionary.read(0x2001, 5, out, size, 0) == AbortCode::kNone);
  CHECK(size == 0);
  CHECK(fixture.write(0x2001, 5, {'a', 'b', 'c'}) == AbortCode::kNone);
  CHECK(fixture.dictionary.read(0x2001, 5, out, size, 0) == AbortCode::kNone);
  CHECK(size == 3);
  CHECK(out[2] == 'c');
  CHECK(fixture.write(0x2001, 5, {1, 2, 3, 4, 5, 6, 7, 8, 9}) == AbortCode::kParameterLength);
  CHECK(fixture.dictionary.read(0x2001, 5, std::span(out).first(2), size, 0) == AbortCode::kReadLength);
}

TEST_CASE("set() and get() are the device's own side: no access rights, no limits") {
  Fixture fixture;
  CHECK(fixture.dictionary.set(0x2000, 0, 200));
  CHECK(fixture.dictionary.get(0x2000, 0) == 200);
  CHECK(fixture.write(0x2000, 0, {1}) == AbortCode::kReadOnly);
  CHECK_FALSE(fixture.dictionary.set(0x2002, 0, 1));
  CHECK_FALSE(fixture.dictionary.set(0x2001, 5, 1));
  CHECK(fixture.dictionary.get(0x2002, 0) == 0);
}
