// SPDX-License-Identifier: MIT
// Program download (CiA 302-3) into a flash that fails, tears units, and loses its power. CBF43926h is the
// CRC-32 of "123456789".

#include "cbcan/canopen/program_download.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

namespace {

/// Two pages of four units, written once each after an erase.
struct SmallMemory {
  static constexpr std::size_t kUnit = 4, kPage = 16, kPages = 2, kBytes = 32;

  bool erase(std::size_t page) {
    if (page == 0) startable = 0;
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(page * kPage), kPage, 0xFF);
    return page != bad_page;
  }
  bool write(std::size_t offset, std::span<const std::uint8_t> unit) {
    CHECK(bytes[offset] == 0xFF);
    std::ranges::copy(unit, bytes.begin() + static_cast<std::ptrdiff_t>(offset));
    if (offset == torn) bytes[offset] ^= 1;
    return offset != bad_unit;
  }
  ProgramStatus seal(std::size_t size, std::uint32_t crc) {
    if (crc32(0, std::span(bytes).first(size)) != crc) return ProgramStatus::kCrc;
    if (sealed == ProgramStatus::kGood) startable = crc;
    return sealed;
  }
  std::uint32_t crc() const { return startable; }
  void control(ProgramCommand command) { done = static_cast<int>(command); }

  static constexpr std::size_t kNone = 99;
  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(kBytes, 0);
  std::uint32_t startable = 0x1234;
  std::size_t bad_page = kNone, bad_unit = kNone, torn = kNone;
  ProgramStatus sealed = ProgramStatus::kGood;
  int done = -1;  ///< the last command
};

struct ProgramRig {
  explicit ProgramRig(bool runs = false) : download(memory, runs) {}

  std::uint32_t read(std::uint16_t index) {
    CHECK(is_program_number(index));
    std::array<std::uint8_t, 4> bytes{};
    CHECK(download.on_read(index, bytes) == AbortCode::kNone);
    return load_word(bytes.data());
  }
  std::uint32_t state() { return read(0x1F57); }
  AbortCode control(std::uint8_t command) { return download.on_write(command, 0); }
  AbortCode send(std::string_view text, std::size_t offset = 0, bool last = true) {
    const std::vector<std::uint8_t> bytes(text.begin(), text.end());
    return download.on_piece({0x1F50, 1, offset, bytes, last}, 0);
  }
  void clear() {
    CHECK(control(3) == AbortCode::kNone);
    for (int pages = 0; pages < 2; ++pages)
      CHECK(download.poll(0) == 0);
  }

  SmallMemory memory;
  ProgramDownload<SmallMemory> download;
};

}  // namespace

TEST_CASE("program download: clear, bytes in pieces of any size, start") {
  ProgramRig rig;
  CHECK(rig.read(0x1F51) == 0);
  CHECK(rig.read(0x1F56) == 0x1234);
  CHECK(rig.state() == 0);
  CHECK(rig.send("1") == AbortCode::kDeviceState);
  CHECK(rig.state() == 4 << 1);
  CHECK(rig.control(3) == AbortCode::kNone);
  CHECK(rig.state() == (1 << 1 | 1));
  CHECK(rig.send("", 0, false) == AbortCode::kLater);
  CHECK(rig.memory.startable == 0x1234);
  CHECK(rig.download.poll(0) == 0);
  CHECK(rig.memory.startable == 0);  // before the first page
  CHECK(rig.download.poll(0) == 0);
  CHECK(rig.state() == 1 << 1);
  CHECK(rig.control(1) == AbortCode::kDeviceState);
  CHECK(rig.send("123", 0, false) == AbortCode::kNone);
  CHECK(rig.send("45", 3) == AbortCode::kNone);
  CHECK(rig.send("6789") == AbortCode::kNone);  // another download
  CHECK(rig.state() == 0);
  CHECK(rig.read(0x1F56) == 0xCBF43926);
  CHECK(rig.memory.startable == 0);
  CHECK(rig.control(1) == AbortCode::kNone);
  CHECK(rig.memory.startable == 0xCBF43926);
  CHECK(std::string(rig.memory.bytes.begin(), rig.memory.bytes.begin() + 12) == "123456789\xFF\xFF\xFF");
  CHECK(rig.download.poll(99'999) == 100'000);
  CHECK(rig.memory.done == -1);
  CHECK(rig.download.poll(100'000) == kNever);
  CHECK(rig.memory.done == 1);
}

TEST_CASE("program download: a running program can be stopped and reset") {
  ProgramRig rig(true);
  CHECK(rig.read(0x1F51) == 1);
  CHECK(rig.control(3) == AbortCode::kDeviceState);
  CHECK(rig.send("1") == AbortCode::kDeviceState);
  CHECK(rig.control(4) == AbortCode::kValue);
  CHECK(rig.control(1) == AbortCode::kNone);
  CHECK(rig.download.poll(0) == kNever);
  const auto command = GENERATE(as<std::uint8_t>(), 0, 2);
  CHECK(rig.control(command) == AbortCode::kNone);
  rig.download.poll(100'000);
  CHECK(rig.memory.done == command);
}

TEST_CASE("program download: a stopped program starts again without a clear") {
  ProgramRig rig;
  CHECK(rig.control(0) == AbortCode::kNone);
  CHECK(rig.download.poll(0) == kNever);
  CHECK(rig.control(1) == AbortCode::kNone);
  rig.download.poll(100'000);
  CHECK(rig.memory.done == 1);
}

TEST_CASE("program download: of several commands the last one counts") {
  ProgramRig rig;
  rig.clear();
  rig.send("123456789");
  for (const std::uint8_t command :
       std::array<std::uint8_t, 5>{1, 1, 0, 1, 3})  // a start whose response was lost is sent again
    CHECK(rig.control(command) == AbortCode::kNone);
  for (int pages = 0; pages < 3; ++pages)
    rig.download.poll(100'000);
  CHECK(rig.memory.done == -1);
  ProgramRig running(true);
  CHECK((running.control(0) == AbortCode::kNone && running.control(1) == AbortCode::kNone));
  CHECK(running.download.poll(100'000) == kNever);
  CHECK((running.control(0) == AbortCode::kNone && running.control(3) == AbortCode::kDeviceState));
  running.download.poll(100'000);
  CHECK(running.memory.done == 0);  // a refused command takes back nothing
}

TEST_CASE("program download: after what goes wrong nothing is startable until the next clear") {
  ProgramRig rig;
  std::uint32_t status = 0;
  SECTION("an aborted download") {
    rig.clear();
    rig.send("12345", 0, false);
    rig.download.on_aborted();
    status = 3;
  }
  SECTION("a page that cannot be erased") {
    rig.memory.bad_page = 1;
    rig.clear();
    status = 5;
  }
  SECTION("a unit that cannot be written") {
    rig.memory.bad_unit = 8;
    rig.clear();
    status = 5;
    SECTION("in the middle") {
      CHECK(rig.send("123456789ABC") == AbortCode::kHardware);
    }
    SECTION("the last one") {
      rig.send("123456789");
      CHECK(rig.control(1) == AbortCode::kHardware);
    }
  }
  SECTION("more than there is room for") {
    rig.clear();
    CHECK(rig.send(std::string(32, '1'), 0, false) == AbortCode::kNone);
    CHECK(rig.send("1", 32) == AbortCode::kParameterLength);
    rig.download.on_aborted();
    status = 6;
  }
  SECTION("found at the start") {
    rig.clear();
    if (GENERATE(false, true))
      rig.memory.torn = 0;
    else
      rig.memory.sealed = ProgramStatus::kFormat;
    status = rig.memory.torn == 0 ? 3 : 2;
    rig.send("123456789");
    CHECK(rig.control(1) == AbortCode::kHardware);
  }
  CHECK(rig.state() == status << 1);
  CHECK(rig.control(1) == AbortCode::kDeviceState);
  CHECK(rig.send("1") == AbortCode::kDeviceState);
  CHECK(rig.state() == status << 1);
  rig.memory.bad_page = rig.memory.bad_unit = SmallMemory::kNone;
  rig.clear();
  CHECK(rig.send("1") == AbortCode::kNone);
}

}  // namespace cbcan::test
