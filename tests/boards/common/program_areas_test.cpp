// SPDX-License-Identifier: MIT
// Programs in a flash memory whose power is cut before, in the middle of, and after each write and each
// erasure. The CRCs were calculated by Python's zlib.

#include "boards/common/program_areas.hpp"

#include <map>
#include <stdexcept>
#include <vector>

#include "support/catch.hpp"

namespace cbcan::test {
namespace {

using boards::ProgramAreas;

struct PowerCut {};

/// Two pages an area. A unit is written once after an erasure, or again with zeros.
template <std::size_t kUnitBytes>
struct NorFlash {
  static constexpr std::size_t kUnit = kUnitBytes, kPage = 128, kBytes = 256;
  static constexpr std::uint32_t kRunsAt = 0x1000, kHeaderAt = 16;

  std::span<const std::uint8_t> area(std::size_t number) const {
    return std::span(bytes).subspan(number * kBytes, kBytes);
  }
  bool erase(std::size_t number, std::size_t page) {
    return step([&](std::size_t halves) {
      std::fill_n(bytes.begin() + offset_of(number, page * kPage), kPage / 2 * halves, std::uint8_t{0xFF});
    });
  }
  bool write(std::size_t number, std::size_t offset, std::span<const std::uint8_t> unit) {
    const auto place = bytes.begin() + offset_of(number, offset);
    const bool clears = std::ranges::all_of(unit, [](std::uint8_t byte) { return byte == 0; });
    const bool erased = std::all_of(place, place + kUnit, [](std::uint8_t byte) { return byte == 0xFF; });
    if (unit.size() != kUnit || offset % kUnit != 0 || !(clears || erased))
      throw std::logic_error("no unit, or one that is not erased");
    return step([&](std::size_t halves) { std::copy_n(unit.begin(), kUnit / 2 * halves, place); });
  }

  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(3 * kBytes, 0xFF);
  unsigned steps = 0, cut_at = 0, part = 0;  ///< the step that is cut, from 1, after so many halves
  unsigned broken_at = 0;                    ///< that fails

 private:
  static auto offset_of(std::size_t number, std::size_t offset) {
    return static_cast<std::ptrdiff_t>(number * kBytes + offset);
  }
  bool step(auto act) {
    ++steps;
    act(steps == cut_at ? part : 2);
    if (steps == cut_at) throw PowerCut();
    return steps != broken_at;
  }
};

const std::map<unsigned, std::uint32_t> kHeaderCrcs{{1, 0xD9A7F3C3}, {2, 0xEB8A8278}, {3, 0x4CBEAF2E}};
const std::map<unsigned, std::uint32_t> kCrcs{{1, 0xC01EE745}, {2, 0xED3AB582}, {3, 0xF626843F}};

void put(std::vector<std::uint8_t>& bytes, std::uint32_t number) {
  for (int shift = 0; shift < 32; shift += 8)
    bytes.push_back(static_cast<std::uint8_t>(number >> shift));
}

/// Vectors of 16 bytes, the header, 40 bytes.
std::vector<std::uint8_t> program(unsigned number, std::string_view board = "mcu") {
  std::vector<std::uint8_t> bytes(16, static_cast<std::uint8_t>(number));
  put(bytes, 0x4E414342);
  put(bytes, 1);
  bytes.insert(bytes.end(), board.begin(), board.end());
  bytes.resize(16 + 40);
  put(bytes, 0x1044);
  put(bytes, 0x106C);
  put(bytes, kHeaderCrcs.at(number));
  bytes.resize(bytes.size() + 40, static_cast<std::uint8_t>(number + 0x80));
  return bytes;
}

template <class Flash>
struct Machine {
  Flash flash;

  ProgramAreas<Flash> areas() { return {flash, {.board = "mcu"}}; }

  /// Does what a ProgramDownload does.
  ProgramStatus download(std::vector<std::uint8_t> bytes) {
    auto areas = this->areas();
    const std::size_t size = bytes.size();
    const std::uint32_t crc = crc32(0, bytes);
    bytes.resize((size + Flash::kUnit - 1) / Flash::kUnit * Flash::kUnit, 0xFF);
    for (std::size_t page = 0; page < 2; ++page)
      areas.erase(page);
    for (std::size_t at = 0; at < bytes.size(); at += Flash::kUnit)
      areas.write(at, std::span(bytes).subspan(at, Flash::kUnit));
    return areas.seal(size, crc);
  }
  /// The number of the program that a boot loader starts; 0 = none.
  unsigned start() {
    if (!areas().boot()) return 0;
    const unsigned number = flash.area(0)[0];
    REQUIRE(areas().crc() == kCrcs.at(number));
    REQUIRE(std::ranges::equal(flash.area(0).first(program(number).size()), program(number)));
    return number;
  }
  void with(unsigned number, bool confirmed = true) {
    REQUIRE(download(program(number)) == ProgramStatus::kGood);
    REQUIRE(start() == number);
    if (confirmed) REQUIRE(areas().confirm());
  }
};

/// `act`, cut at each of its steps; and `after` each cut with the machine as it is then. How many steps there
/// are.
template <class Flash>
unsigned each_cut(const Machine<Flash>& before, auto act, auto after) {
  for (unsigned cut = 1;; ++cut)
    for (unsigned part = 0; part <= 2; ++part) {
      Machine<Flash> machine = before;
      machine.flash.steps = 0;
      machine.flash.cut_at = cut;
      machine.flash.part = part;
      try {
        act(machine);
        return cut - 1;
      } catch (const PowerCut&) {
        machine.flash.cut_at = 0;
        after(machine, part == 2);
      }
    }
}

template <class Flash>
void cut_everywhere() {
  Machine<Flash> with_1;
  with_1.with(1);
  const auto download = [](Machine<Flash>& machine) { machine.download(program(2)); };
  const auto start = [](Machine<Flash>& machine) { machine.start(); };

  unsigned new_ones = 0;
  const unsigned writes = each_cut(with_1, download, [&](Machine<Flash>& machine, bool) {
    const unsigned number = machine.start();
    CHECK((number == 1 || number == 2));
    new_ones += number == 2;
  });
  CHECK(new_ones >= 1);  // after the last write
  CHECK(new_ones <= 2);
  CHECK(writes == 2 + (108 + Flash::kUnit - 1) / Flash::kUnit + 16 / std::min<std::size_t>(Flash::kUnit, 16));

  Machine<Flash> downloaded = with_1;
  downloaded.download(program(2));
  const auto always_one = [&](Machine<Flash>& machine, bool) {
    each_cut(machine, start, [](Machine<Flash>& again, bool) { CHECK(again.start() != 0); });
    const unsigned number = machine.start();
    CHECK((number == 1 || number == 2));
    const unsigned next = machine.start();  // without confirm(): the one before
    CHECK(next == 1);
    CHECK(machine.start() == 1);
  };
  CHECK(each_cut(downloaded, start, always_one) > 2 * writes);

  Machine<Flash> failed = downloaded;
  CHECK(failed.start() == 2);
  each_cut(failed, start, [](Machine<Flash>& machine, bool) { CHECK(machine.start() == 1); });
  Machine<Flash> works = downloaded;
  CHECK(works.start() == 2);
  each_cut(
      works, [](Machine<Flash>& machine) { machine.areas().confirm(); },
      [](Machine<Flash>& machine, bool) {
        const unsigned number = machine.start();
        CHECK((number == 1 || number == 2));
        CHECK(machine.start() == number);
      });
}

TEST_CASE("program areas: a power cut at any step, and at any step after it, leaves a program that runs") {
  cut_everywhere<NorFlash<4>>();
  cut_everywhere<NorFlash<8>>();
  cut_everywhere<NorFlash<32>>();
}

using TestMachine = Machine<NorFlash<8>>;

TEST_CASE("program areas: the first program, updates of an update, the one before") {
  TestMachine machine;
  CHECK(machine.start() == 0);
  CHECK(machine.areas().crc() == 0);
  machine.with(1);
  for (int starts = 0; starts < 3; ++starts)
    CHECK(machine.start() == 1);
  machine.with(2);
  machine.with(3);
  machine.with(1, false);
  CHECK(machine.start() == 3);  // not 2
}

TEST_CASE("program areas: a program on trial never becomes the one before") {
  TestMachine machine;
  machine.with(1);
  machine.with(2, false);
  machine.with(3, false);
  CHECK(machine.start() == 1);
}

TEST_CASE("program areas: a first program that does not work leaves the boot loader, and can be sent again") {
  TestMachine machine;
  machine.with(1, false);
  CHECK(machine.start() == 0);
  machine.with(1, false);
  machine.with(2);
  CHECK(machine.start() == 2);
}

TEST_CASE("program areas: the same program again is on trial, and is the one before, too") {
  TestMachine machine;
  machine.with(1);
  machine.with(1, false);
  CHECK(machine.start() == 1);
}

TEST_CASE("program areas: what is no program for this board is not installed") {
  TestMachine machine;
  machine.with(1);
  CHECK(machine.download(program(2, "other")) == ProgramStatus::kFormat);
  CHECK(machine.start() == 1);
  CHECK(machine.download(std::vector<std::uint8_t>(60, 7)) == ProgramStatus::kFormat);
  auto bytes = program(2);
  bytes.back() ^= 1;
  CHECK(machine.download(bytes) == ProgramStatus::kCrc);
  bytes = program(2);
  bytes.pop_back();
  CHECK(machine.download(bytes) == ProgramStatus::kAddress);
  bytes = program(2);
  bytes[3] ^= 1;  // of the vectors
  CHECK(machine.download(bytes) == ProgramStatus::kCrc);
  CHECK(machine.start() == 1);
  CHECK(machine.areas().crc() == kCrcs.at(1));
}

TEST_CASE("program areas: bits that rot in the program bring the one before back") {
  TestMachine machine;
  machine.with(1);
  machine.with(2);
  machine.flash.bytes[70] ^= 4;
  CHECK(machine.start() == 1);
}

TEST_CASE("program areas: a write or an erasure that fails is made good at the next start") {
  TestMachine ready;
  ready.with(1);
  ready.download(program(2));
  for (unsigned broken = 1; broken < 70; ++broken) {
    TestMachine machine = ready;
    machine.flash.steps = 0;
    machine.flash.broken_at = broken;
    CAPTURE(broken);
    for (int starts = 0; starts < 3; ++starts) {
      const bool failed = machine.start() == 0;
      CHECK((!failed || starts < 2));
    }
  }
}

TEST_CASE("program areas: in the boot loader a program whose trial is over is not startable") {
  TestMachine machine;
  const auto startable = [&] {
    return ProgramAreas<NorFlash<8>, true>(machine.flash, {.board = "mcu"}).crc();
  };
  machine.with(1, false);
  CHECK(startable() == 0);
  CHECK(machine.start() == 0);
  machine.with(2);
  CHECK(startable() == kCrcs.at(2));
  machine.with(3, false);
  CHECK(startable() == kCrcs.at(2));  // the one before
  CHECK(machine.start() == 2);
}

TEST_CASE("program areas: a signature decides if there is a function for it") {
  TestMachine machine;
  ProgramAreas<NorFlash<8>> areas(
      machine.flash,
      {.board = "mcu", .is_signed = [](std::span<const std::uint8_t> whole) { return whole[0] == 2; }});
  machine.download(program(1));
  CHECK(areas.seal(108, kCrcs.at(1)) == ProgramStatus::kFormat);
  machine.flash.bytes.assign(machine.flash.bytes.size(), 0xFF);
  machine.download(program(2));
  std::fill_n(machine.flash.bytes.begin() + 256 + 224, 16, std::uint8_t{0xFF});  // its record
  CHECK(areas.seal(108, kCrcs.at(2)) == ProgramStatus::kGood);
}

}  // namespace
}  // namespace cbcan::test
