// SPDX-License-Identifier: MIT
#pragma once

/// Programs in flash for a boot loader: the Memory of a ProgramDownload, and what to start.
///
///   area 0   where programs run, which they are linked for
///   area 1   takes a download
///   area 2   the program before, as a copy
///
/// An area begins with a program: vectors, ImageHeader, the rest. Its last units say what is known of it. A
/// new program is copied to area 0, after the confirmed one there was copied to area 2. It is on trial until
/// it calls confirm(): if the board is reset earlier, the one before comes back. Every step may be cut by a
/// power failure and is done again: nothing counts before its last write.
///
/// `Flash` has
///   kUnit, kPage, kBytes   bytes that are written at once (4..32), erased at once, and of an area
///   kRunsAt                address of area 0
///   kHeaderAt              offset of the ImageHeader: the size of the vectors
///   area(number)           its bytes, as a span
///   erase(number, page), write(number, offset, unit)  false = failed; feed the watchdog, too

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "boards/common/image_header.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/program_download.hpp"

namespace cbcan::boards {

/// `kBoots`: in the boot loader, where a trial has ended.
template <class Flash, bool kBoots = false>
class ProgramAreas {
 public:
  using Bytes = std::span<const std::uint8_t>;
  static constexpr std::size_t kUnit = Flash::kUnit, kPages = Flash::kBytes / Flash::kPage;
  static constexpr std::size_t kRecordBytes = std::max<std::size_t>(kUnit, 16);
  /// Most bytes of a program: the rest of an area is its record and two marks.
  static constexpr std::size_t kBytes = Flash::kBytes - 2 * kUnit - kRecordBytes;

  struct Settings {
    std::string_view board;                      ///< that the ImageHeader names
    bool (*is_signed)(Bytes program) = nullptr;  ///< of a signature; null = every program counts
    void (*control)(ProgramCommand) = nullptr;   ///< resets the board: ProgramDownload
  };

  ProgramAreas(Flash& flash, const Settings& settings) : flash_(flash), settings_(settings) {}

  /// Called by a boot loader at its start: installs what was downloaded. True: the program of area 0 is to be
  /// started; false: there is none.
  bool boot() {
    if (!has(kReceived, kUsed) && is_whole(kReceived)) install();
    if (may_start() && (has(kRunning, kConfirmed) || mark(kRunning, kUsed))) return true;
    return is_whole(kBefore) && copy(kBefore, kRunning) && mark(kRunning, kConfirmed);
  }

  /// Called by the program as soon as it works. False: the flash failed.
  bool confirm() { return has(kRunning, kConfirmed) || mark(kRunning, kConfirmed); }

  // ---- Memory of a ProgramDownload
  bool erase(std::size_t page) { return flash_.erase(kReceived, page); }
  bool write(std::size_t offset, Bytes unit) { return flash_.write(kReceived, offset, unit); }
  ProgramStatus seal(std::size_t size, std::uint32_t crc) {
    if (crc32(0, program(kReceived, size)) != crc) return ProgramStatus::kCrc;
    const ProgramStatus status = check_header(program(kReceived, size));
    if (status != ProgramStatus::kGood) return status;
    return put_record(kReceived, static_cast<std::uint32_t>(size), crc) ? status : ProgramStatus::kWrite;
  }
  std::uint32_t crc() const {
    const Area area = kBoots && !may_start() ? kBefore : kRunning;  // as boot() decides
    return is_whole(area) ? record(area).crc : 0;
  }
  void control(ProgramCommand command) { settings_.control(command); }

 private:
  enum Area : std::size_t { kRunning, kReceived, kBefore };
  /// Units from the end of an area: kUsed is that of area 0 started, that of area 1 copied.
  enum Mark : std::size_t { kUsed = 1, kConfirmed };

  struct Record {
    std::uint32_t size, crc;
    bool operator==(const Record&) const = default;
  };
  Bytes program(Area area, std::size_t size) const { return flash_.area(area).first(size); }
  std::uint32_t word(Area area, std::size_t offset) const { return load_word(&flash_.area(area)[offset]); }

  // ---- What is known of an area

  /// Each number and its complement; anything else is a record that was cut.
  Record record(Area area) const {
    const Record found{word(area, kBytes), word(area, kBytes + 4)};
    const bool good = word(area, kBytes + 8) == ~found.size && word(area, kBytes + 12) == ~found.crc;
    return good && found.size <= kBytes ? found : Record{};
  }
  bool put_record(Area area, std::uint32_t size, std::uint32_t crc) {
    std::array<std::uint8_t, kRecordBytes> bytes{};
    const std::array<std::uint32_t, 4> words{size, crc, ~size, ~crc};
    for (std::size_t i = 0; i < words.size(); ++i)
      store_little_endian(std::span(bytes).subspan(4 * i, 4), words[i]);
    for (std::size_t at = 0; at < kRecordBytes; at += kUnit)
      if (!flash_.write(area, kBytes + at, Bytes(bytes).subspan(at, kUnit))) return false;
    return true;
  }

  bool is_whole(Area area) const {
    const auto [size, crc] = record(area);
    return size != 0 && crc32(0, program(area, size)) == crc;
  }

  /// Part of a mark counts: its writer had decided.
  bool has(Area area, Mark mark) const {
    const Bytes unit = flash_.area(area).subspan(Flash::kBytes - mark * kUnit, kUnit);
    return std::ranges::any_of(unit, [](std::uint8_t byte) { return byte != 0xFF; });
  }
  bool mark(Area area, Mark mark) {
    return flash_.write(area, Flash::kBytes - mark * kUnit, std::array<std::uint8_t, kUnit>{});
  }

  // ---- Steps

  void install() {
    const bool whole = is_whole(kRunning);
    const bool copied = whole && record(kRunning) == record(kReceived) && !has(kRunning, kUsed);
    if (whole && has(kRunning, kConfirmed) && !copied && !copy(kRunning, kBefore)) return;
    if (copied || copy(kReceived, kRunning)) mark(kReceived, kUsed);
  }

  bool may_start() const {
    return is_whole(kRunning) && (has(kRunning, kConfirmed) || !has(kRunning, kUsed));
  }

  bool copy(Area from, Area to) {
    const auto [size, crc] = record(from);
    for (std::size_t page = 0; page < kPages; ++page)
      if (!flash_.erase(to, page)) return false;
    for (std::size_t at = 0; at < size; at += kUnit)
      if (!flash_.write(to, at, flash_.area(from).subspan(at, kUnit))) return false;
    return put_record(to, size, crc);
  }

  /// The CRC covers the vectors, the header up to it, and begin..end.
  ProgramStatus check_header(Bytes program) const {
    constexpr std::size_t kMark = Flash::kHeaderAt, kBoard = kMark + 8, kBegin = kMark + 40,
                          kCrc = kMark + 48;
    if (program.size() < kCrc + 4 || load_word(&program[kMark]) != ImageHeader::kMark)
      return ProgramStatus::kFormat;
    for (std::size_t i = 0; i < 16; ++i)
      if (program[kBoard + i] != (i < settings_.board.size() ? settings_.board[i] : 0))
        return ProgramStatus::kFormat;
    const std::size_t begin = load_word(&program[kBegin]) - Flash::kRunsAt;
    const std::size_t end = load_word(&program[kBegin + 4]) - Flash::kRunsAt;
    if (begin > end || end > program.size()) return ProgramStatus::kAddress;
    const std::uint32_t crc = crc32(crc32(0, program.first(kCrc)), program.subspan(begin, end - begin));
    if (crc != load_word(&program[kCrc])) return ProgramStatus::kCrc;
    return settings_.is_signed == nullptr || settings_.is_signed(program) ? ProgramStatus::kGood
                                                                          : ProgramStatus::kFormat;
  }

  Flash& flash_;
  Settings settings_;
};

}  // namespace cbcan::boards
