// SPDX-License-Identifier: MIT
// The ring, and the events of the demo plant: in bus order, each with its transaction.

#include <fmt/format.h>

#include "plant/journal_lines.hpp"

namespace cbcan::journal {
namespace {

using Lines = std::vector<std::string>;

/// A minute with noise, faults and all kinds of transactions.
Lines session(const std::string& more) {
  const auto plant = plant::test::demo(more);
  plant::test::JournalLines seen(*plant);
  Lines all;
  for (const char* command :
       {"fault 0x42 response-never probability=0.3", "fault bus frame-loss probability=0.05", "nmt start all",
        "incident 16 overtemperature on", "power 1 off"})
    plant->execute(command);
  for (int i = 0; i < 60; ++i) {
    plant->execute("trigger read 0x42 0x6401 1 2");
    plant->execute("pass 1s");
    for (std::string& line : seen.lines())
      all.push_back(std::move(line));
  }
  return all;
}

}  // namespace

TEST_CASE("a frame is a node's where its identifier is, and node guarding's request") {
  const auto plant = plant::test::demo();
  const Journal& journal = plant->control().journal();
  const auto node_of = [&](std::string_view frame) {
    REQUIRE(plant->execute(fmt::format("send {}", frame)) == "ok\n");
    unsigned node = 0xFFFF;
    Cursor cursor(journal, journal.first(), kinds_of({Kind::kFrame}));
    cursor.look([&](std::uint64_t, const Event& event) {
      const Frame& seen = event.frame;
      if (sim::frame_text(seen) == frame) node = event.node;
      return true;
    });
    return node;
  };
  struct Row {
    const char* frame;
    unsigned node;
  };
  for (const Row& row : {Row{"742#05", 0x42}, Row{"742#R1", 0x42}, Row{"77F#05", 127}, Row{"0C2#00", 0x42},
                         Row{"1C2#00", 0x42}, Row{"1C2#R1", 0}, Row{"642#R1", 0}, Row{"000#0142", 0},
                         Row{"000#R1", 0}, Row{"042#", 0}, Row{"080#", 0}, Row{"100#", 0}, Row{"101#", 1},
                         Row{"780#", 0}, Row{"7E5#04", 0}, Row{"00000742#05", 0}, Row{"00000742#R1", 0}}) {
    INFO(row.frame);
    CHECK(node_of(row.frame) == row.node);
  }
}

TEST_CASE("the ring keeps the last 100,000 events, and each its bytes as long as there is room") {
  Journal journal;
  int filled = 0;
  journal.on_filled = [&] { ++filled; };
  Cursor behind(journal);
  const std::string long_text(60'000, 'x');
  CHECK(journal.first() == 1);
  journal.add({.kind = Kind::kCommand}, long_text);
  for (int i = 0; i < 120'000; ++i)
    journal.add({.kind = Kind::kState, .node = 7});
  CHECK((journal.first() == 20'002 && journal.end() == 120'002 && filled == 2));
  std::size_t seen = 0;
  CHECK(behind.look([&](std::uint64_t number, const Event&) { return seen += number != 0, true; }) == 20'001);
  CHECK(seen == 100'000);
  const std::uint64_t number = journal.end();
  for (int i = 0; i < 200; ++i)  // 12 MB
    journal.add({.kind = Kind::kCommand}, long_text);
  CHECK(journal.text(journal[number]).empty());
  CHECK(journal.text(journal[journal.end() - 100]) == long_text);
}

TEST_CASE("a view of some kinds sees those alone, and has missed nothing where none of them has come") {
  Journal journal;
  Cursor view(journal, journal::kinds_of({Kind::kClient, Kind::kModbus}));  // the last and the first kind
  std::vector<std::uint64_t> seen;
  const auto look = [&] {
    return view.look([&](std::uint64_t number, const Event&) { return seen.push_back(number), true; });
  };
  for (int i = 0; i < 100'010; ++i)
    journal.add({.kind = Kind::kFrame});
  CHECK_FALSE(view.has_news());
  CHECK((look() == 0 && seen.empty()));
  journal.add({.kind = Kind::kClient});
  journal.add({.kind = Kind::kState});
  journal.add({.kind = Kind::kModbus});
  CHECK(view.has_news());
  CHECK((look() == 0 && seen == std::vector<std::uint64_t>{100'011, 100'013}));
  journal.add({.kind = Kind::kModbus});
  for (int i = 0; i < 100'000; ++i)
    journal.add({.kind = Kind::kFrame});
  CHECK((look() == 1 && seen.size() == 2));
  CHECK_FALSE(view.has_news());
}

TEST_CASE("values at terminals") {
  const auto plant = plant::test::demo();
  plant::test::JournalLines seen(*plant);
  for (const char* command : {
           "trigger write 0x42 0x6202 1 1 0x80",  // polarity
           "trigger write 0x42 0x6200 1 1 5", "trigger write 0x42 0x6411 1 2 0xFFFB", "set 0x42 0x6000:1 3",
           "set 0x42 0x6000:1 6", "set 0x42 0x6000:1 6", "set 0x42 0x6401:1 6",
           "nmt stop 0x42",  // error values: off, and polarity
       })
    plant->execute(command);
  Lines lines = seen.lines();
  std::erase_if(lines, [](const std::string& line) { return line.find("put:") == std::string::npos; });
  CHECK(lines == Lines{"0.000000 node 66 output:8 on", "0.000000 node 66 output:1 on, output:3 on",
                       "0.000000 node 66 analogue-output:1 = -5", "0.000000 node 66 input:1 on, input:2 on",
                       "0.000000 node 66 input:1 off, input:3 on",
                       "0.000000 node 66 output:1 off, output:3 off",
                       "0.000000 node 66 analogue-output:1 = 0"});
}

TEST_CASE("a Modbus request belongs to the transaction of the registers that it is about") {
  std::array<std::uint16_t, 4168> registers{};
  const std::span<std::uint16_t> all(registers);
  const auto window = all.subspan<3700, 70>();
  const std::array windows{PlcWindow{3700, window, {}}};
  const RegisterRange range{0, registers};
  Journal journal;
  sim::World world;
  const auto& module = world.add_module(RegisterWindow(window), all.subspan<3800, 128>(), {});
  NetworkWatch watch(journal, {1, world, &module, registers, 3800, 3928, 0}, windows);
  const auto transaction_of = [&](const std::vector<std::uint8_t>& pdu) {
    Cursor cursor(journal, kinds_of({Kind::kModbus}));
    watch.on_modbus({1, 1, 1, 0, pdu, pdu}, modbus::check(pdu, RegisterMap(std::span(&range, 1)), nullptr),
                    0);
    std::uint32_t transaction = 0;
    cursor.look([&](std::uint64_t, const Event& event) { return transaction = event.transaction, true; });
    return transaction;
  };
  CHECK(transaction_of({3, 0x0E, 0x74, 0, 1}) == 0);
  window[0] = 0xCA0E;
  CHECK(transaction_of({6, 0x0E, 0x74, 0xCA, 0x0E}) == 1);
  CHECK(transaction_of({3, 0x0E, 0x73, 0, 2}) == 1);  // R3699, R3700
  CHECK(transaction_of({3, 0x0E, 0x73, 0, 1}) == 0);  // R3699
  CHECK(transaction_of({16, 0x0E, 0x73, 0, 2, 4, 0, 0, 0xCA, 0x0E}) == 1);
  CHECK(transaction_of({6, 0x0E, 0x73, 0xFF, 0xFF}) == 0);  // the second word is a value, not a quantity
  CHECK(transaction_of({22, 0x0E, 0x73, 0xFF, 0xFF, 0, 0}) == 0);
  CHECK(transaction_of({3, 0x0E, 0xB9, 0, 1}) == 1);  // R3769
  CHECK(transaction_of({3, 0x0E, 0xBA, 0, 1}) == 0);
}

TEST_CASE("a Modbus request as text: its registers, and the words of the request or the response") {
  Journal journal;
  sim::World world;
  NetworkWatch watch(journal, {1, world, nullptr, {}, 3800, 3928, 0}, {});
  const auto text_of_request = [&](const std::vector<std::uint8_t>& pdu,
                                   const std::vector<std::uint8_t>& response) {
    Cursor cursor(journal, kinds_of({Kind::kModbus}));
    watch.on_modbus({1, 1, 1, 0, pdu, response}, {}, 0);
    std::string text;
    cursor.look(
        [&](std::uint64_t, const Event& event) { return text = text_of(event, journal, nullptr), true; });
    return text;
  };
  CHECK(text_of_request({3, 0x0E, 0x74, 0, 2}, {3, 4, 0xCA, 0x0E, 0, 1})
            .ends_with("FC3 R3700..R3701: 51726 1"));
  CHECK(text_of_request({6, 0x0E, 0x74, 0, 7}, {6, 0x0E, 0x74, 0, 7}).ends_with("FC6 R3700 = 7"));
  CHECK(text_of_request({16, 0x0E, 0x74, 0, 1, 2, 0, 7}, {16, 0x0E, 0x74, 0, 1}).ends_with("FC16 R3700 = 7"));
  CHECK(text_of_request({22, 0x0E, 0x74, 0, 0xF2, 0, 0x25}, {22, 0x0E, 0x74, 0, 0xF2, 0, 0x25})
            .ends_with("FC22 R3700 = 242 37"));
}

TEST_CASE("the same seed gives the same journal") {
  const Lines once = session("");
  CHECK(once.size() > 300);
  CHECK(session("") == once);
  CHECK(session("[random]\nseed = 2\n") != once);
}

}  // namespace cbcan::journal
