// SPDX-License-Identifier: MIT
// Which SDO frames belong to a transaction of the PLC. The frames are written by hand from CiA 301.

#include <fmt/format.h>

#include "plant/journal_lines.hpp"

namespace cbcan::journal {
namespace {

using Lines = std::vector<std::string>;

/// A watch with R3700 and the scanner window of channel 1.
class Rig {
 public:
  /// The PLC reads or writes through R3700.
  void request(std::uint16_t command, std::uint16_t index, std::uint16_t sub, std::uint16_t node = 5) {
    window_ = {0xCA0E, command, node, index, sub, 4};
    watch_.before(now_);
  }
  /// The same through the scanner window.
  void scan(std::uint16_t command, std::uint16_t index, std::uint16_t sub, std::uint16_t node = 5) {
    out_ = {++in_[regmap::kScannerTaken], command, node, index, sub, 4};
    watch_.after(now_);
  }
  void end(std::uint16_t result) {
    window_[0] = result;
    watch_.after(now_);
  }
  void pass(Time time) { now_ += time; }

  /// The transactions of these frames, "1 1 0".
  std::string credits(std::string_view frames) {
    Cursor cursor(journal_, kinds_of({Kind::kFrame}));
    for (const std::string_view frame : base::words_of(frames))
      watch_.on_bus_frame(*sim::parse_frame(frame), now_);
    std::string list;
    cursor.look([&](std::uint64_t, const Event& event) {
      list += (list.empty() ? "" : " ") + std::to_string(event.transaction);
      return true;
    });
    return list;
  }

 private:
  std::array<std::uint16_t, 70> window_{}, out_{};
  std::array<std::uint16_t, 68> in_{};
  Journal journal_;
  sim::World world_;
  NetworkWatch watch_{journal_,
                      {1, world_, nullptr, {}, 3800, 3928, 0},
                      std::array{PlcWindow{3700, window_, {}}, PlcWindow{500, out_, in_}}};
  Time now_ = 0;
};

constexpr std::uint16_t kRead = 5055, kWrite = 5066;

/// SDO frames since the start, with their transactions.
Lines sdo_frames(const Journal& journal) {
  Lines lines;
  Cursor(journal, journal.first(), kinds_of({Kind::kFrame})).look([&](std::uint64_t, const Event& event) {
    if (const std::uint32_t id = event.frame.id & 0x780; id == 0x580 || id == 0x600)
      lines.push_back(fmt::format("{} #{} {}", base::seconds_text(event.at), event.transaction,
                                  sim::frame_text(event.frame)));
    return true;
  });
  return lines;
}

}  // namespace

TEST_CASE("what the module asks an absent node does not belong to the PLC's read of it") {
  for (const char* object : {"0x6401 1", "0x1000 0"}) {
    CAPTURE(object);
    const auto plant = plant::test::booting("[[node]]\nid = 99\n");
    const Journal& journal = plant->control().journal();
    plant->execute("pass 1050ms");  // the module asks it since 1.0 s
    plant->execute(fmt::format("trigger read 99 {} 4", object));
    plant->execute("pass 60s");
    Lines lines = sdo_frames(journal);
    CHECK(lines.size() > 80);
    std::erase_if(lines, [](const std::string& line) { return line.find("#0") != std::string::npos; });
    REQUIRE(lines.size() == 2);
    CHECK(lines[0].find(" #1 663#40") != std::string::npos);
    CHECK(lines[1].find(" #1 663#80") != std::string::npos);
  }
}

TEST_CASE("a frame of another object does not belong to the transaction, before, while and after it runs") {
  Rig rig;
  rig.request(kRead, 0x6401, 1);
  CHECK(rig.credits("605#4000100000000000 585#4300100092010000") == "0 0");  // 1000h: another's
  CHECK(rig.credits("605#2301640100000000 585#6001640100000000") == "0 0");  // written by another
  CHECK(rig.credits("606#4001640100000000 586#4B01640101000000") == "0 0");  // of another node
  CHECK(rig.credits("605#4001640100000000") == "1");
  rig.end(4);
  CHECK(rig.credits("605#8001640100000405") == "1");
  CHECK(rig.credits("605#8000100000000405 585#8000100000000206") == "0 0");
  CHECK(rig.credits("585#4B01640101000000") == "1");  // late
  CHECK(rig.credits("605#4001640100000000 585#4B01640101000000") ==
        "0 0");  // the same object, asked by another
  CHECK(rig.credits("605#8001640100000405") == "0");
}

TEST_CASE("a late response belongs to its transaction for as long as the module may wait for it") {
  Rig rig;
  rig.request(kRead, 0x6401, 1);
  CHECK(rig.credits("605#4001640100000000") == "1");
  rig.end(4);
  rig.pass(59 * kSecond);
  CHECK(rig.credits("585#4B01640101000000") == "1");
  rig.pass(2 * kSecond);
  CHECK(rig.credits("585#4B01640101000000") == "0");
}

TEST_CASE("segments belong to the transfer that was initiated last") {
  Rig rig;
  rig.request(kRead, 0x1008, 0);
  CHECK(rig.credits("605#4010180000000000 585#4110180009000000 605#6000000000000000") == "0 0 0");
  CHECK(rig.credits("605#4008100000000000 585#4108100009000000 605#6000000000000000 585#0061626364656667 "
                    "605#7000000000000000 585#1B68690000000000") == "1 1 1 1 1 1");
  rig.end(0);
  CHECK(rig.credits("605#4018100100000000 585#4318100101000000") == "0 0");
  rig.request(kWrite, 0x2000, 0);
  CHECK(rig.credits("605#2100200009000000 585#6000200000000000 605#0061626364656667 585#2000000000000000 "
                    "605#1B68690000000000 585#3000000000000000") == "2 2 2 2 2 2");
}

TEST_CASE("segments of a block look like any frame, and belong to the block") {
  Rig rig;
  rig.request(kWrite, 0x2000, 0);
  rig.scan(kRead, 0x6364, 0x65);
  // Segment 40h, which looks like the read that waits, is 64 of the block.
  CHECK(rig.credits("605#C600200010000000 585#A400200040000000 605#0161626364656667 605#4064636566676800 "
                    "585#A240400000000000 605#C500000000000000 585#A100000000000000") == "1 1 1 1 1 1 1");
  rig.end(0);
  CHECK(rig.credits("605#4064636500000000 585#4F64636501000000") == "2 2");
  rig.request(kRead, 0x2000, 0);
  CHECK(rig.credits("605#A400200040000000 585#C600200008000000 605#A300000000000000 585#6061626364656667 "
                    "585#8168696A6B6C6D6E 605#A202400000000000 585#C500000000000000 605#A100000000000000") ==
        "3 3 3 3 3 3 3 3");
}

TEST_CASE(
    "a block that the server does not know is repeated in segments, and belongs to the same transaction") {
  Rig rig;
  rig.request(kRead, 0x2000, 0);
  CHECK(rig.credits("605#A400200040000000 585#8000200001000405 605#4000200000000000 585#4B00200001000000") ==
        "1 1 1 1");
}

TEST_CASE("of several transactions with a node, each has the frames of its object") {
  Rig rig;
  rig.request(kRead, 0x6401, 1);
  rig.scan(kRead, 0x6401, 2);
  CHECK(rig.credits("605#4001640200000000 585#4B01640201000000") == "2 2");
  CHECK(rig.credits("605#4001640100000000 585#4B01640101000000") == "1 1");
}

}  // namespace cbcan::journal
