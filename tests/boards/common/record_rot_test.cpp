// SPDX-License-Identifier: MIT
// A record log whose flash has one bit that is another one than was written.

#include <optional>

#include "boards/common/flash_model.hpp"
#include "boards/common/record.hpp"
#include "boards/common/record_log.hpp"

using namespace cbcan::boards;
using cbcan::test::Bytes;
using cbcan::test::Cut;
using cbcan::test::FlashModel;
using cbcan::test::PowerCut;
using cbcan::test::Record;
using Result = RecordLog::Result;

namespace {

/// A record in flash, as record_log.hpp describes it.
struct Place {
  std::size_t sector, begin, end;
  std::uint32_t number;
  Bytes bytes;
};

Bytes bytes_of(std::span<const std::uint32_t> words) {
  Bytes bytes;
  for (const std::uint32_t word : words)
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
  return bytes;
}

/// CCITT's, x^16 + x^12 + x^5 + 1, from 0.
std::uint16_t crc_of(const Bytes& bytes) {
  unsigned crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc ^= unsigned{byte} << 8;
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc << 1 ^ (crc & 0x8000 ? 0x1021 : 0)) & 0xFFFF;
  }
  return static_cast<std::uint16_t>(crc);
}

std::optional<Place> place_at(const FlashModel& flash, std::size_t sector, std::size_t begin) {
  const auto words = flash.sector(sector).subspan(begin);
  const std::size_t bytes = words[0] & 0xFFFF, last = 2 + (bytes + 3) / 4;
  if (words[0] >> 16 != (bytes ^ 0xFFFF) || last >= words.size()) return std::nullopt;
  if (words[last] != (0xA55A0000 | crc_of(bytes_of(words.first(last))))) return std::nullopt;
  Bytes content = bytes_of(words.subspan(2, last - 2));
  content.resize(bytes);
  return Place{sector, begin, begin + last + 1, words[1], content};
}

std::vector<Place> places(const FlashModel& flash) {
  std::vector<Place> found;
  for (std::size_t sector = 0; sector < 2; ++sector)
    for (std::size_t at = 1; at < flash.sector(sector).size(); ++at)
      if (auto place = place_at(flash, sector, at)) found.push_back(*place);
  return found;
}

/// What the newest whole record holds that this word is no part of; nothing where there is none.
Bytes newest_without(const std::vector<Place>& places, std::size_t sector, std::size_t word) {
  std::uint32_t number = 0;
  Bytes bytes;
  for (const Place& each : places) {
    if (each.sector == sector && each.begin <= word && word < each.end) continue;
    if (each.number > number) bytes = each.bytes;
    number = std::max(number, each.number);
  }
  return bytes;
}

constexpr std::size_t kRottenWords = 24;  // of a sector: three records and more

/// Records of 0 to 19 bytes, and a restart wherever the log is full, until the power goes.
void live(FlashModel& flash) {
  std::optional<RecordLog> log;
  log.emplace(flash).start();
  for (std::size_t number = 1; number < 12; ++number) {
    const Record record(Bytes(number * 7 % 20, static_cast<std::uint8_t>(number)));
    if (log->append(record) == Result::kKept) continue;
    log.emplace(flash).start();
    if (log->append(record) != Result::kKept) FAIL("no room after a start");
  }
}

/// What a life is when the power goes at operation `at`.
FlashModel lived(Cut cut, std::size_t at) {
  FlashModel flash(kRottenWords);
  flash.cut = cut;
  flash.cut_at = at;
  try {
    live(flash);
  } catch (const PowerCut&) {
  }
  flash.cut_at = SIZE_MAX;
  return flash;
}

/// False: `expected` is not what is loaded, or what is saved then is not there after one more start.
bool comes_back(FlashModel flash, const Bytes& expected) {
  const Bytes next{1, 2, 3, 4};
  RecordLog log(flash);
  log.start();
  if (!std::ranges::equal(log.latest(), expected)) return false;
  if (log.append(Record(next)) != Result::kKept) return false;
  RecordLog again(flash);
  again.start();
  return std::ranges::equal(again.latest(), next);
}

/// The power goes at operation `at` of a start; false = it has fewer.
bool start_cut(FlashModel& flash, Cut cut, std::size_t at) {
  flash.cut = cut;
  flash.cut_at = flash.operations + at;
  bool was_cut = false;
  try {
    RecordLog(flash).start();
  } catch (const PowerCut&) {
    was_cut = true;
  }
  flash.cut_at = SIZE_MAX;
  return was_cut;
}

/// check(rotten flash, what is to be loaded) for each bit; false = something is lost.
template <class Check>
void rot(const FlashModel& flash, Check check) {
  const std::vector<Place> before = places(flash);
  for (std::size_t sector = 0; sector < 2; ++sector)
    for (std::size_t word = 0; word < kRottenWords; ++word)
      for (unsigned bit = 0; bit < 32; ++bit) {
        FlashModel rotten = flash;
        rotten.sectors[sector][word] ^= 1u << bit;
        if (!check(rotten, newest_without(before, sector, word)))
          FAIL("lost: sector " << sector << ", word " << word << ", bit " << bit);
      }
}

}  // namespace

TEST_CASE("Record log: a rotten bit in an older record, all newer ones are there") {
  FlashModel flash(kRottenWords);
  RecordLog log(flash);
  log.start();
  for (std::uint8_t number = 1; number <= 3; ++number)
    REQUIRE(log.append(Record({number})) == Result::kKept);
  REQUIRE(places(flash).size() == 3);
  for (const std::size_t word : {1u, 2u, 3u, 4u}) {  // length, number, bytes, CRC
    FlashModel rotten = flash;
    rotten.sectors[0][word] ^= 0x100;
    CHECK(comes_back(rotten, {3}));
  }
}

TEST_CASE("Record log: each bit rots, after each operation at which the power has gone") {
  const std::size_t operations = lived(Cut::kBefore, SIZE_MAX).operations;
  REQUIRE(operations > 80);
  for (const Cut cut : {Cut::kBefore, Cut::kHalfWay})
    for (std::size_t at = 0; at <= operations; ++at) {
      INFO("cut " << static_cast<int>(cut) << " at " << at);
      rot(lived(cut, at), comes_back);
    }
}

TEST_CASE("Record log: each bit rots, and the power goes at each operation of the start that finds it") {
  const std::size_t operations = lived(Cut::kBefore, SIZE_MAX).operations;
  for (const Cut cut : {Cut::kBefore, Cut::kHalfWay})
    for (std::size_t at = 0; at <= operations; at += 11) {
      INFO("cut at " << at);
      rot(lived(Cut::kBefore, at), [&](const FlashModel& rotten, const Bytes& expected) {
        for (std::size_t further = 0;; ++further) {
          FlashModel flash = rotten;
          if (!start_cut(flash, cut, further)) return true;
          if (!comes_back(flash, expected)) return false;
        }
      });
    }
}
