// SPDX-License-Identifier: MIT
#include "boards/common/record_log.hpp"

#include <cstdlib>
#include <optional>

#include "boards/common/flash_model.hpp"

using namespace cbcan::boards;
using cbcan::AbortCode;
using cbcan::test::Cut;
using cbcan::test::FlashModel;
using cbcan::test::PowerCut;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A record's content.
struct Record final : RecordLog::Source {
  explicit Record(Bytes content) : bytes(std::move(content)) {}
  /// Up to three bytes in each call.
  bool put_some(RecordLog& log, bool begins) override {
    if (begins) place = 0;
    for (const std::size_t end = std::min(place + 3, bytes.size()); place < end; ++place)
      log.put(bytes[place]);
    return place < bytes.size();
  }
  Bytes bytes;
  std::size_t place = 0;
};

constexpr std::size_t kWords = 32;        // in a sector: four or five records
constexpr std::size_t kRottenWords = 24;  // in a sector: three records and more

AbortCode append(RecordLog& log, Record record) {
  AbortCode answer = AbortCode::kLater;
  while (answer == AbortCode::kLater)
    answer = log.append(record);
  return answer;
}

Bytes latest(const RecordLog& log) {
  return {log.latest().begin(), log.latest().end()};
}

/// Appends records of 0 to 19 bytes, and restarts when the log is full. `kept`: the last confirmed content;
/// `wanted`: the other content that is allowed. The power is cut at operation `at`.
struct Life {
  Life(std::size_t words, std::size_t records, Cut cut = Cut::kBefore, std::size_t at = SIZE_MAX,
       std::size_t unit_words = 1)
      : flash(words, unit_words) {
    flash.cut = cut;
    flash.cut_at = at;
    try {
      live(records);
    } catch (const PowerCut&) {
      was_cut = true;
    }
    flash.cut_at = SIZE_MAX;
  }
  void live(std::size_t records) {
    std::optional<RecordLog> log;
    log.emplace(flash).start();
    for (std::size_t number = 1; number < records; ++number) {
      wanted = Bytes(number * 7 % 20, static_cast<std::uint8_t>(number));
      if (append(*log, Record(wanted)) != AbortCode::kNone) {
        log.emplace(flash).start();
        if (latest(*log) != kept) FAIL("a restart has lost a record");
        if (append(*log, Record(wanted)) != AbortCode::kNone) FAIL("no room after a start");
      }
      kept = wanted;
    }
  }
  FlashModel flash;
  Bytes kept, wanted;
  bool was_cut = false;
};

/// The loaded content; none if a record appended afterwards is not found by the next start.
std::optional<Bytes> loaded(FlashModel flash) {
  const Bytes next{1, 2, 3, 4};
  RecordLog log(flash);
  log.start();
  const Bytes found = latest(log);
  if (append(log, Record(next)) != AbortCode::kNone || latest(log) != next) return {};
  RecordLog again(flash);
  again.start();
  return latest(again) == next ? std::optional(found) : std::nullopt;
}

/// Cuts the power at operation `at` of a start; false = it has fewer operations.
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

/// The content of the newest complete record without this word; empty if there is none.
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

/// check(damaged flash, expected content) for each bit; false = something is lost.
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

TEST_CASE("Record log: the words of a record") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  CHECK(append(log, Record({1, 2, 3, 4, 5})) == AbortCode::kNone);
  // The CRC of 05 00 FA FF 01 00 00 00 01 02 03 04 05 00 00 00 by CCITT's polynomial, from 0.
  const std::vector<std::uint32_t> words{0xCB0CA001, 0xFFFA0005, 1, 0x04030201, 0x00000005};
  CHECK(std::ranges::equal(flash.sector(0).first(5), words));
  CHECK(flash.sector(0)[5] >> 16 == 0xA55A);
  CHECK(latest(log) == Bytes{1, 2, 3, 4, 5});
}

TEST_CASE("Record log: of flash with anything in it nothing is believed") {
  FlashModel flash(kWords);
  flash.sectors[0].assign(kWords, 0);
  RecordLog log(flash);
  log.start();
  CHECK(log.latest().empty());
  CHECK(append(log, Record({7})) == AbortCode::kNone);
}

TEST_CASE("Record log: a sector whose erasure has not been confirmed is erased again") {
  FlashModel flash(kWords);
  for (auto& sector : flash.sectors)
    sector.assign(kWords, Flash::kErased);
  RecordLog(flash).start();
  CHECK(flash.erasures == 2);
  RecordLog(flash).start();
  CHECK(flash.erasures == 2);
}

TEST_CASE("Record log: the same record is not written twice") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  REQUIRE(append(log, Record({7, 8})) == AbortCode::kNone);
  const std::size_t before = flash.operations;
  CHECK(append(log, Record({7, 8})) == AbortCode::kNone);
  CHECK(flash.operations == before);
  CHECK(append(log, Record({7})) == AbortCode::kNone);
  CHECK(latest(log) == Bytes{7});
}

TEST_CASE("Record log: full is full until the next start") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  const std::size_t erasures = flash.erasures;
  std::uint8_t number = 0;
  while (append(log, Record(Bytes(12, ++number))) == AbortCode::kNone)
    REQUIRE(number < 20);
  CHECK(number == 11);  // two sectors of 31 words, 6 per record
  CHECK(append(log, Record({})) == AbortCode::kDeviceState);
  CHECK(latest(log) == Bytes(12, 10));
  CHECK(flash.erasures == erasures);
  RecordLog again(flash);
  again.start();
  CHECK(latest(again) == Bytes(12, 10));
  CHECK(append(again, Record(Bytes(12, 11))) == AbortCode::kNone);
  CHECK(flash.erasures == erasures + 1);
}

TEST_CASE("Record log: where an erasure is allowed, as many records as one likes") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  log.allow_erase(true);
  const std::size_t erasures = flash.erasures;
  for (std::uint8_t number = 1; number <= 52; ++number) {
    REQUIRE(append(log, Record(Bytes(12, number))) == AbortCode::kNone);
    REQUIRE(latest(log) == Bytes(12, number));
  }
  CHECK(flash.erasures == erasures + 9);  // five records in a sector; two were blank
  log.allow_erase(false);
  while (append(log, Record(Bytes(12, 99))) == AbortCode::kNone &&
         append(log, Record({})) == AbortCode::kNone) {
  }
  CHECK(flash.erasures == erasures + 9);
}

TEST_CASE("Record log: one that can never fit") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  CHECK(append(log, Record(Bytes(4 * (kWords - 4) + 1))) == AbortCode::kReadLength);
  CHECK(append(log, Record(Bytes(4 * (kWords - 4)))) == AbortCode::kNone);
  CHECK(append(log, Record({1})) == AbortCode::kNone);
}

TEST_CASE("Record log: flash that fails is reported, and its contents are read") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  REQUIRE(append(log, Record({1, 2})) == AbortCode::kNone);
  flash.defective = true;
  CHECK(append(log, Record({3})) == AbortCode::kHardware);
  CHECK(latest(log) == Bytes{1, 2});
  flash.defective = false;
  CHECK(append(log, Record({3})) == AbortCode::kNone);
  RecordLog again(flash);
  again.start();
  CHECK(latest(again) == Bytes{3});
}

TEST_CASE(
    "Record log: a power cut at each operation, and at each one of the next start, loses nothing") {
  const std::size_t operations = Life(kWords, 25).flash.operations;
  REQUIRE(operations > 140);
  for (const Cut cut : {Cut::kBefore, Cut::kHalfWay, Cut::kAfter})
    for (std::size_t at = 0; at < operations; ++at) {
      const Life life(kWords, 25, cut, at);
      REQUIRE(life.was_cut);
      bool cut_again = true;
      for (std::size_t further = 0; cut_again; ++further) {
        FlashModel flash = life.flash;
        cut_again = start_cut(flash, cut, further);
        const auto found = loaded(flash);
        if (found != life.kept && found != life.wanted)
          FAIL("lost: cut " << static_cast<int>(cut) << " at " << at);
      }
    }
}

TEST_CASE("Record log: an interrupted write of a unit reads as anything, and as something else later") {
  using Reading = std::uint32_t (*)(std::uint32_t);
  const Reading readings[] = {
      [](std::uint32_t value) { return value; }, [](std::uint32_t /*value*/) { return Flash::kErased; },
      [](std::uint32_t /*value*/) { return 0u; }, [](std::uint32_t value) { return value | 0x0F0F0F0F; }};
  for (const std::size_t unit : {1u, 2u, 4u, 8u}) {
    const std::size_t operations = Life(kWords * unit, 16, Cut::kBefore, SIZE_MAX, unit).flash.operations;
    REQUIRE(operations > 40);
    for (std::size_t at = 0; at < operations; ++at)
      for (const Reading first : readings) {
        INFO(unit << " words, cut at " << at);
        Life life(kWords * unit, 16, Cut::kHalfWay, at, unit);
        life.flash.read_torn(first);
        RecordLog log(life.flash);
        log.start();
        if (latest(log) != life.kept && latest(log) != life.wanted) FAIL("lost");
        if (append(log, Record({1, 2, 3})) != AbortCode::kNone) FAIL("no room");
        for (const Reading later : readings) {
          life.flash.read_torn(later);
          RecordLog again(life.flash);
          again.start();
          if (latest(again) != Bytes{1, 2, 3}) FAIL("lost later");
        }
      }
  }
}

/// Every operation takes half a minute with sanitizers: all of them with CBCAN_LONG, else every seventh.
std::size_t stride() {
  return std::getenv("CBCAN_LONG") != nullptr ? 1 : 7;
}

TEST_CASE("Record log: each bit rots, after each operation at which the power has gone") {
  const std::size_t operations = Life(kRottenWords, 12).flash.operations;
  REQUIRE(operations > 70);
  for (const Cut cut : {Cut::kBefore, Cut::kHalfWay})
    for (std::size_t at = 0; at <= operations; at += stride()) {
      INFO("cut " << static_cast<int>(cut) << " at " << at);
      rot(Life(kRottenWords, 12, cut, at).flash,
          [](const FlashModel& rotten, const Bytes& expected) { return loaded(rotten) == expected; });
    }
}

TEST_CASE("Record log: each bit rots, and the power goes at each operation of the start that finds it") {
  const std::size_t operations = Life(kRottenWords, 12).flash.operations;
  for (const Cut cut : {Cut::kBefore, Cut::kHalfWay})
    for (std::size_t at = 0; at <= operations; at += 11 * stride()) {
      INFO("cut at " << at);
      rot(Life(kRottenWords, 12, Cut::kBefore, at).flash,
          [&](const FlashModel& rotten, const Bytes& expected) {
            for (std::size_t further = 0;; ++further) {
              FlashModel flash = rotten;
              if (!start_cut(flash, cut, further)) return true;
              if (loaded(flash) != expected) return false;
            }
          });
    }
}

TEST_CASE("Record log: a torn record that becomes readable later is older than one that was confirmed") {
  FlashModel flash(kWords);
  {
    RecordLog log(flash);
    log.start();
    REQUIRE(append(log, Record({1, 1, 1, 1})) == AbortCode::kNone);
    Record unfinished({2, 2, 2, 2, 2, 2});
    for (int parts = 0; parts < 3; ++parts)
      REQUIRE(log.append(unfinished) == AbortCode::kLater);
    log.restart();
    flash.cut = Cut::kHalfWay;
    flash.cut_at = flash.operations + 3;  // in the seal
    REQUIRE_THROWS_AS(append(log, Record({3, 3, 3, 3})), PowerCut);
    flash.cut_at = SIZE_MAX;
  }
  flash.read_torn([](std::uint32_t) { return Flash::kErased; });
  RecordLog log(flash);
  log.start();
  REQUIRE(append(log, Record({4, 4, 4, 4})) == AbortCode::kNone);
  flash.read_torn([](std::uint32_t value) { return value; });
  CHECK(loaded(flash) == Bytes{4, 4, 4, 4});
}
