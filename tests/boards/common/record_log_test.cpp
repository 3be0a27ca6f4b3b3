// SPDX-License-Identifier: MIT
#include "boards/common/record_log.hpp"

#include "boards/common/flash_model.hpp"
#include "boards/common/record.hpp"

using namespace cbcan::boards;
using cbcan::test::Bytes;
using cbcan::test::Cut;
using cbcan::test::FlashModel;
using cbcan::test::PowerCut;
using cbcan::test::Record;
using Result = RecordLog::Result;

namespace {

Bytes latest(const RecordLog& log) {
  return {log.latest().begin(), log.latest().end()};
}

/// One of many records, of 0 to 19 bytes.
Bytes numbered(std::size_t number) {
  return Bytes(number * 7 % 20, static_cast<std::uint8_t>(number));
}

/// A life: records, and a restart wherever the log is full. `kept` is what has been confirmed, `wanted` what
/// may be there besides.
void live(FlashModel& flash, Bytes& kept, Bytes& wanted) {
  std::optional<RecordLog> log;
  const auto restart = [&] {
    log.emplace(flash).start();
    CHECK(latest(*log) == kept);
  };
  restart();
  for (std::size_t number = 1; number < 25; ++number) {
    wanted = numbered(number);
    Result result = log->append(Record(wanted));
    if (result == Result::kFull) {
      restart();
      result = log->append(Record(wanted));
    }
    REQUIRE(result == Result::kKept);
    kept = wanted;
  }
}

/// The power goes at operation `at` of a start; true = that has so many.
bool start_cut_at(FlashModel& flash, std::size_t at) {
  flash.cut_at = flash.operations + at;
  RecordLog log(flash);
  try {
    log.start();
  } catch (const PowerCut&) {
    flash.cut_at = SIZE_MAX;
    return true;
  }
  flash.cut_at = SIZE_MAX;
  return false;
}

constexpr std::size_t kWords = 32;  // of a sector: four or five records

}  // namespace

TEST_CASE("Record log: the words of a record") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  CHECK(log.append(Record({1, 2, 3, 4, 5})) == Result::kKept);
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
  CHECK(log.append(Record({7})) == Result::kKept);
}

TEST_CASE("Record log: a sector whose erasure has not been confirmed is erased again") {
  FlashModel flash(kWords);
  for (auto& sector : flash.sectors)
    sector.assign(kWords, Flash::kErased);
  RecordLog(flash).start();
  CHECK(flash.erasures == 1);
  RecordLog(flash).start();
  CHECK(flash.erasures == 1);
}

TEST_CASE("Record log: the same record is not written twice") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  REQUIRE(log.append(Record({7, 8})) == Result::kKept);
  const std::size_t before = flash.operations;
  CHECK(log.append(Record({7, 8})) == Result::kKept);
  CHECK(flash.operations == before);
  CHECK(log.append(Record({7})) == Result::kKept);
  CHECK(latest(log) == Bytes{7});
}

TEST_CASE("Record log: full is full until the next start, which alone erases") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  const std::size_t erasures = flash.erasures;
  std::uint8_t number = 0;
  while (log.append(Record(Bytes(12, ++number))) == Result::kKept)
    REQUIRE(number < 20);
  CHECK(number == 6);  // 31 words, 6 a record
  CHECK(log.append(Record({})) == Result::kFull);
  CHECK(latest(log) == Bytes(12, 5));
  CHECK(flash.erasures == erasures);
  RecordLog again(flash);
  again.start();
  CHECK(latest(again) == Bytes(12, 5));
  CHECK(again.append(Record(Bytes(12, 6))) == Result::kKept);
  CHECK(flash.erasures == erasures + 1);
}

TEST_CASE("Record log: one that can never fit") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  CHECK(log.append(Record(Bytes(4 * kWords))) == Result::kFull);
  CHECK(log.append(Record({1})) == Result::kKept);
}

TEST_CASE("Record log: flash that does not work is told, and what it has is read") {
  FlashModel flash(kWords);
  RecordLog log(flash);
  log.start();
  REQUIRE(log.append(Record({1, 2})) == Result::kKept);
  flash.defective = true;
  CHECK(log.append(Record({3})) == Result::kFailed);
  CHECK(latest(log) == Bytes{1, 2});
  flash.defective = false;
  CHECK(log.append(Record({3})) == Result::kFailed);  // until the next start
  RecordLog again(flash);
  again.start();
  CHECK(latest(again) == Bytes{1, 2});
  CHECK(again.append(Record({3})) == Result::kKept);
}

TEST_CASE(
    "Record log: a power cut at each operation, and at each one of the start behind it, loses nothing") {
  FlashModel whole(kWords);
  Bytes kept, wanted;
  live(whole, kept, wanted);
  REQUIRE(whole.operations > 150);
  for (const Cut cut : {Cut::kBefore, Cut::kHalfWay, Cut::kAfter}) {
    for (std::size_t at = 0; at < whole.operations; ++at) {
      FlashModel flash(kWords);
      flash.cut = cut;
      flash.cut_at = at;
      kept = wanted = {};
      CHECK_THROWS_AS(live(flash, kept, wanted), PowerCut);
      bool cut_again = true;
      for (std::size_t further = 0; cut_again; ++further) {
        FlashModel copy = flash;
        cut_again = start_cut_at(copy, further);
        RecordLog later(copy);
        later.start();
        const Bytes found = latest(later);
        if (found != kept && found != wanted) FAIL("lost: cut " << static_cast<int>(cut) << " at " << at);
        REQUIRE(later.append(Record({1, 2, 3, 4})) == Result::kKept);
        CHECK(latest(later) == Bytes{1, 2, 3, 4});
      }
    }
  }
}
