// SPDX-License-Identifier: MIT
// What 1010h stores, in the flash of a board with a coprocessor.

#include "boards/common/parameter_store.hpp"

#include "boards/common/flash_model.hpp"
#include "support/storing_coprocessor.hpp"

using namespace cbcan;
using namespace cbcan::boards;
using test::FlashModel;
using test::kLoad;
using test::kSave;

namespace {

/// A board; on() switches it on again.
struct Board : test::StoringCoprocessor {
  void on(bool leave_aside = false, std::uint8_t node_id = 127) {
    settings = {1, 1152};
    store.emplace(flash, settings, [](std::span<const std::uint16_t> words) { return words[0] != 0; });
    store->start(leave_aside);
    start(*store, node_id);
  }
  FlashModel flash{4096};
  std::array<std::uint16_t, 2> settings{};
  std::optional<ParameterStore> store;
};

/// A record as another image has written it.
struct OtherImage final : RecordLog::Source {
  explicit OtherImage(std::initializer_list<int> values) : bytes(values) {}
  bool put_some(RecordLog& log, bool /*begins*/) override {
    for (const int byte : bytes)
      log.put(static_cast<std::uint8_t>(byte));
    return false;
  }
  void keep_in(Flash& flash) {
    RecordLog log(flash);
    log.start();
    REQUIRE(log.append(*this) == AbortCode::kLater);
    REQUIRE(log.append(*this) == AbortCode::kNone);
  }
  std::vector<int> bytes;
};

}  // namespace

TEST_CASE("1010h: each parameter is what it was after power has been off") {
  Board board;
  board.on();
  CHECK(board.get(0x1010, 0) == 4);
  CHECK(board.get(0x1010, 1) == 1);  // saves on command
  CHECK(board.get(0x1011, 4) == 1);
  board.put_all();
  board.save();
  board.put(0x1017, 0, 2, 1).check_done();  // not saved
  board.on();
  board.check_all();
  board.bench->write(0, 0x1F82, 127, 1, {1}).check_done();
  board.bench->arrive("185#3412");  // RPDO 1 and TPDO 16 work
  CHECK(board.bench->reg(3800) == 0x1234);
  board.bench->port.sent.clear();
  board.bench->put(3864, {0x0102});
  board.bench->pass(20 * kMillisecond).expect("1FF#02010000");
}

TEST_CASE("1010h: stored values are back after a reset of the node, and of its communication") {
  Board board;
  board.on();
  board.put(0x1006, 0, 4, 1000);
  board.put(0x3003, 0, 2, 250);
  board.save();
  for (const std::uint16_t reset : {std::uint16_t{129}, std::uint16_t{130}}) {
    board.put(0x1006, 0, 4, 2000);
    board.put(0x3003, 0, 2, 300);
    board.bench->write(0, 0x1F82, 127, 1, {reset}).expect("77F#00");
    CHECK(board.get(0x1006, 0) == 1000);
    CHECK(board.get(0x3003, 0) == (reset == 129 ? 250 : 300));
  }
}

TEST_CASE("1010h: 3003h and 3004h of the window that it is written through, for both from then on") {
  Board board;
  board.on();
  board.put(0x3003, 0, 2, 250);
  board.save();
  board.on();
  for (std::uint16_t number = 1; number < 3; ++number) {  // the first request reports the restart
    board.bench->registers.put(500, {number, 5055, 0, 0x3003, 0, 2});
    board.bench->coprocessor.on_registers_written(500, 70, board.bench->now);
    board.bench->poll();
  }
  CHECK(board.bench->reg(604) == 250);
}

TEST_CASE("1010h and 1011h: a sub-index is a range, the others keep what is stored") {
  Board board;
  board.on();
  const auto change = [&](std::uint16_t number) {
    board.put(0x1017, 0, 2, number);
    board.put(0x3003, 0, 2, number);
    board.settings[1] = number;
  };
  const auto check = [&](std::uint16_t communication, std::uint16_t manufacturer, std::uint16_t settings) {
    board.on();
    CHECK(board.get(0x1017, 0) == communication);
    CHECK(board.get(0x3003, 0) == manufacturer);
    CHECK(board.settings[1] == settings);
  };
  change(500);
  board.save(2);
  check(500, 1000, 1152);
  change(600);
  board.save(4);
  check(500, 600, 600);
  change(700);
  board.save(3);  // no application parameters
  check(500, 600, 600);
  board.command(0x1011, 2, kLoad).check_done();
  CHECK(board.get(0x1017, 0) == 500);  // until the next reset
  check(0, 600, 600);
  change(800);
  board.save(1);
  check(800, 800, 800);
  board.command(0x1011, 1, kLoad).check_done();
  check(0, 1000, 1152);
}

TEST_CASE(
    "1010h: board settings that are none are refused, and stored ones that no longer are do not count") {
  Board board;
  board.on();
  board.settings = {0, 96};
  board.command(0x1010, 1, kSave).check_failed(0x06090030);
  board.command(0x1010, 2, kSave).check_done();
  board.settings = {9, 96};
  board.save();
  board.on();
  CHECK(board.settings == std::array<std::uint16_t, 2>{9, 96});
  ParameterStore stricter(board.flash, board.settings,
                          [](std::span<const std::uint16_t> words) { return words[0] < 9; });
  board.settings = {1, 1152};
  stricter.start(false);
  CHECK(board.settings == std::array<std::uint16_t, 2>{1, 1152});
}

TEST_CASE("1010h: with the strap set nothing that is stored counts, and all of it is still there") {
  Board board;
  board.on();
  board.put(0x1017, 0, 2, 500);
  board.settings = {5, 96};
  board.save();
  board.on(true);
  CHECK(board.get(0x1017, 0) == 0);
  CHECK(board.settings == std::array<std::uint16_t, 2>{1, 1152});
  board.on();
  CHECK(board.get(0x1017, 0) == 500);
  CHECK(board.settings == std::array<std::uint16_t, 2>{5, 96});
}

TEST_CASE("1010h: what has its power-on value takes no room") {
  Board board;
  board.on();
  board.put(0x1017, 0, 2, 500);
  const std::size_t before = board.flash.operations;
  board.save();
  // 1017h, 3003h and two settings of six bytes each, 3004h of five: eight words, and three around them.
  CHECK(board.flash.operations == before + 11);
}

TEST_CASE("1010h: stored values that another image knows otherwise, or not at all, do not count") {
  Board board;
  OtherImage({0x17, 0x10, 0, 4, 1,    2, 3, 4,  // four bytes instead of two
              0x00, 0x20, 1, 1, 9,              // 2000h:01
              0x02, 0x30, 0, 1, 9,              // read-only
              0x03, 0x30, 0, 2, 0xFA, 0,        //
              0x15, 0x10, 0, 2, 7})             // cut short
      .keep_in(board.flash);
  board.on();
  CHECK(board.get(0x1017, 0) == 0);
  CHECK(board.get(0x3002, 0) == 0);
  CHECK(board.get(0x3003, 0) == 250);
  CHECK(board.get(0x1015, 0) == 0);
}

TEST_CASE("1010h: full, and flash that does not work") {
  Board board;
  board.on();
  for (std::uint16_t node = 1; node <= 127; ++node)
    board.put(0x1016, node, 4, std::uint32_t{node} << 16 | 100);
  std::uint16_t saves = 0;
  do {
    board.put(0x1017, 0, 2, ++saves);
    board.command(0x1010, 1, kSave);
  } while (board.bench->reg(3700) == 0 && saves < 40);
  board.bench->check_failed(0x08000022);
  CHECK(saves == 31);  // of two times 16 KB: 127 * 8 + 6 and the board's settings, 12, each time
  board.on();
  CHECK(board.get(0x1017, 0) == saves - 1u);
  board.store->allow_erase(true);
  for (saves = 1; saves <= 62; ++saves) {
    board.put(0x1017, 0, 2, saves);
    board.command(0x1010, 1, kSave).check_done();
  }
  board.put(0x1017, 0, 2, 500);
  board.flash.defective = true;
  board.command(0x1010, 1, kSave).check_failed(0x06060000);
}

TEST_CASE("LSS: node ID and bit rate become the board's settings, and are stored with the others") {
  Board board;
  std::array<std::uint16_t, regmap::kBoardWords> settings{1, 1152, 0, 0, 500, 127};
  const auto on = [&] {
    board.store.emplace(board.flash, settings,
                        [](std::span<const std::uint16_t> words) { return words[4] != 800 && words[5] <= 127; });
    board.store->start(false);
    board.start(*board.store, static_cast<std::uint8_t>(settings[5]));
    board.bench->arrive("7E5#0401000000000000");
  };
  struct Row {
    const char *configured, *response, *stored;
    std::uint16_t bit_rate, node_id;
  };
  on();
  for (const Row& row :
       {Row{"7E5#112A000000000000", "7E4#1100000000000000", "7E4#1700000000000000", 500, 42},
        Row{"7E5#1300070000000000", "7E4#1300000000000000", "7E4#1700000000000000", 20, 42},
        Row{"7E5#1300010000000000", "7E4#1300000000000000", "7E4#1702000000000000", 20, 42},
        Row{"7E5#1300090000000000", "7E4#1301000000000000", "7E4#1700000000000000", 20, 42},
        Row{"7E5#11FF000000000000", "7E4#1100000000000000", "7E4#1702000000000000", 20, 42}}) {
    INFO(row.configured);
    board.bench->arrive(row.configured).expect(row.response);
    board.bench->arrive("7E5#1700000000000000").expect(row.stored);
    settings = {1, 1152, 0, 0, 500, 127};
    on();
    CHECK(settings == std::array<std::uint16_t, 6>{1, 1152, 0, 0, row.bit_rate, row.node_id});
    CHECK(board.get(0x3001, 0) == row.node_id);
  }
}

TEST_CASE("LSS: a board without such settings stores nothing") {
  Board board;
  board.on();
  board.bench->arrive("7E5#0401000000000000");
  board.bench->arrive("7E5#1700000000000000").expect("7E4#1702000000000000");
}
