// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "SDO service": the coprocessor's own codes, and whether the server gets an
// abort.

#include "contract/phases.hpp"

using namespace cbcan::contract;

namespace {

/// A response that ends a transfer, and the codes for the server and the PLC.
struct Refusal {
  const char *phase, *response, *abort;
  std::uint32_t code;
};

void check(const Refusal& row) {
  INFO(row.phase << ", answered by " << row.response);
  Window window;
  enter(window, phase_called(row.phase));
  window.arrive(row.response);
  window.expect(row.abort);
  window.check_failed(row.code);
}

constexpr const char *kRead = "605#4000200100000000", *kFirst = "605#6000000000000000",
                     *kSecond = "605#7000000000000000", *kBlockRead = "605#A400200102000000",
                     *kBlockStart = "605#A300000000000000";
constexpr const char *kOfNine = "585#0131323334353637", *kLastOfNine = "585#8238390000000000",
                     *kTaken = "605#A202020000000000";

/// A read with `room` bytes in R3705, in mode 0 or 3, that ends with these frames.
void check_read(std::uint16_t room, const std::vector<Step>& steps, std::uint32_t code,
                const char* abort = nullptr) {
  INFO("answered by " << steps.back().answered);
  Window window;
  if (std::string_view(steps.front().sent) == kBlockRead) window.set_mode(kBlock);
  window.read(5, 0x2000, 1, room).exchange(steps);
  if (abort != nullptr) window.expect(abort);
  window.check_failed(code);
}

}  // namespace

TEST_CASE("[SDO-13] SDO timeout") {
  for (const Phase& phase : phases()) {
    INFO(phase.name);
    Window window;
    enter(window, phase);
    window.pass_nearly(1s);
    if (phase.asked_again != nullptr) window.expect(phase.asked_again);
    window.expect_silence();
    CHECK(window.busy());
    window.pass_rest().expect("605#8000200100000405");
    window.check_failed(0x05040000);
  }
}

TEST_CASE("[SDO-13] each response restarts it") {
  for (const Phase& phase : phases()) {
    if (phase.steps.empty() || phase.asked_again != nullptr) continue;
    INFO(phase.name);
    Window window;
    if (phase.mode != 0) window.set_mode(phase.mode);
    window.start(phase.request);
    for (const Step& step : phase.steps) {
      // Within a sub-block of the server, the rest is requested after half of the timeout.
      const bool of_a_block = *step.sent == 0 || std::string(step.sent) == "605#A300000000000000";
      window.exchange({{step.sent, ""}});
      if (*step.answered != 0) window.pass_nearly(of_a_block ? 500ms : 1s);
      window.exchange({{"", step.answered}});
    }
    window.expect(phase.waiting);
    window.pass_nearly(1s);
    CHECK(window.busy());
    window.pass_rest().expect("605#8000200100000405");
    window.check_failed(0x05040000);
  }
}

TEST_CASE("[SDO-14] toggle bit not alternated") {
  constexpr const char* kAbort = "605#8000200100000305";
  check({"read: first segment", "585#1001020304050607", kAbort, 0x05030000});
  check({"read: second segment", "585#0001020304050607", kAbort, 0x05030000});
  check({"write: first segment", "585#3000000000000000", kAbort, 0x05030000});
  check({"write: last segment", "585#2000000000000000", kAbort, 0x05030000});
}

TEST_CASE("[SDO-15] command specifier that does not belong there") {
  for (const Phase& phase : phases()) {
    if (phase.expected == Phase::kSegment) continue;
    for (const char* command : {"00", "20", "43", "60", "A4", "C6", "E0"}) {
      if (std::stoi(command, nullptr, 16) / 32 == phase.expected) continue;
      INFO(phase.name << ", answered by " << command);
      Window window;
      enter(window, phase);
      window.arrive(std::string("585#") + command + "00200100000000").expect("605#8000200101000405");
      window.check_failed(0x05040001);
    }
  }
}

TEST_CASE("[SDO-15] the subcommands of a block transfer too") {
  constexpr const char* kAbort = "605#8000200101000405";
  check({"block write: start", "585#A200200100000000", kAbort, 0x05040001});
  check({"block write: start", "585#A100200100000000", kAbort, 0x05040001});
  check({"block write: segments", "585#A40020017F000000", kAbort, 0x05040001});
  check({"block write: segments", "585#A100000000000000", kAbort, 0x05040001});
  check({"block write: end", "585#A2027F0000000000", kAbort, 0x05040001});
  check({"block read: start", "585#C500000000000000", kAbort, 0x05040001});
  check({"block read: end", "585#C600200109000000", kAbort, 0x05040001});
}

TEST_CASE("[SDO-16] [SDO-33] larger than R3705") {
  constexpr const char *kAbort = "605#8000200105000405", *kNoSize = "585#4000200100000000";
  check_read(2, {{kRead, "585#4100200103000000"}}, 0x05040005, kAbort);  // by the declared size
  check_read(2, {{kRead, "585#41002001FFFFFFFF"}}, 0x05040005, kAbort);
  check_read(2, {{kRead, "585#4700200111223300"}}, 0x05040005);  // expedited: the server is done
  // At the byte that overflows, also in the last segment.
  check_read(2, {{kRead, kNoSize}, {kFirst, "585#0811223300000000"}}, 0x05040005, kAbort);
  check_read(2, {{kRead, kNoSize}, {kFirst, "585#0911223300000000"}}, 0x05040005, kAbort);
}

TEST_CASE("[SDO-16] in a block transfer") {
  constexpr const char *kAbort = "605#8000200105000405", *kNoSize = "585#C400200100000000";
  check_read(8, {{kBlockRead, "585#C600200109000000"}}, 0x05040005, kAbort);  // by the declared size
  check_read(8, {{kBlockRead, "585#C6002001FFFFFFFF"}}, 0x05040005, kAbort);
  // At the segment that overflows; at the end, which contains the length of the last segment.
  check_read(8, {{kBlockRead, kNoSize}, {kBlockStart, kOfNine}, {"", "585#0238394142434445"}}, 0x05040005,
             kAbort);
  check_read(
      8, {{kBlockRead, kNoSize}, {kBlockStart, kOfNine}, {"", kLastOfNine}, {kTaken, "585#D5C3310000000000"}},
      0x05040005, kAbort);
}

TEST_CASE("[SDO-16] of the own node") {
  Window window;
  window.read(0, 0x1000, 0, 3).check_failed(0x05040005);
  window.read(0, 0x1008, 0, 4).check_failed(0x05040005);
}

TEST_CASE("[SDO-17] [SDO-33] not the size declared") {
  constexpr const char *kAbort = "605#8000200110000706", *kEight = "585#4100200108000000",
                       *kSeven = "585#0001020304050607";
  check_read(128, {{kRead, kEight}, {kFirst, "585#0101020304050607"}}, 0x06070010, kAbort);  // fewer
  // More, and still going on, or in the last segment.
  for (const char* more : {"585#1008090A0B0C0D0E", "585#1B08090000000000"})
    check_read(128, {{kRead, kEight}, {kFirst, kSeven}, {kSecond, more}}, 0x06070010, kAbort);
}

TEST_CASE("[SDO-17] in a block transfer") {
  for (const char* end : {"585#D1C3310000000000", "585#D9C3310000000000"})  // 10 bytes; 8 bytes
    check_read(
        10, {{kBlockRead, "585#C600200109000000"}, {kBlockStart, kOfNine}, {"", kLastOfNine}, {kTaken, end}},
        0x06070010, "605#8000200110000706");
}

TEST_CASE("[SDO-18] of a write") {
  constexpr const char* kBlockSize = "605#8000200102000405";
  check({"block write: start", "585#A400200100000000", kBlockSize, 0x05040002});
  check({"block write: start", "585#A400200180000000", kBlockSize, 0x05040002});
  check({"block write: start", "585#A4002001FF000000", kBlockSize, 0x05040002});
  check({"block write: segments", "585#A202000000000000", kBlockSize, 0x05040002});
  check({"block write: segments", "585#A202800000000000", kBlockSize, 0x05040002});
  check({"block write: segments", "585#A2037F0000000000", "605#8000200103000405", 0x05040003});
}

TEST_CASE("[SDO-18] of a read") {
  constexpr const char* kSequence = "605#8000200103000405";
  check({"block read: one segment", "585#0338390000000000", kSequence, 0x05040003});
  check({"block read: one segment", "585#8338390000000000", kSequence, 0x05040003});
  check({"block read: one segment", "585#0038390000000000", kSequence, 0x05040003});
  check({"block read: end", "585#D5C2310000000000", "605#8000200104000405", 0x05040004});
  check({"block read: end", "585#D5C3320000000000", "605#8000200104000405", 0x05040004});
}

TEST_CASE("[SDO-19] boot-up during the transfer") {
  for (const Phase& phase : phases()) {
    INFO(phase.name);
    Window window;
    enter(window, phase);
    window.arrive("706#00", "705#7F");
    CHECK(window.busy());
    window.arrive("705#00").expect_silence();
    window.check_failed(0x08000022);
  }
}

TEST_CASE("[SDO-20] one abort where the server may still wait") {
  for (const Phase& phase : phases()) {
    INFO(phase.name);
    Window window;
    enter(window, phase);
    window.pass(1s);
    if (phase.asked_again != nullptr) window.expect(phase.asked_again);
    window.pass_rest().expect("605#8000200100000405");
    window.check_failed(0x05040000);
    window.arrive("585#4100200114000000", "585#0001020304050607", "585#6000200100000000",
                  "585#2000000000000000", "585#A40020017F000000", "585#A2027F0000000000",
                  "585#C600200109000000", "585#D5C3310000000000");
    window.pass(5s).expect_silence();
    window.check_failed(0x05040000);
  }
}

TEST_CASE("[SDO-20] whatever these are") {
  Window window;
  window.read(5, 0x1A2B, 0x3C, 4).exchange({{"605#402B1A3C00000000", "585#412B1A3C05000000"}});
  window.expect("605#802B1A3C05000405");
  window.check_failed(0x05040005);
}

TEST_CASE("[SDO-20] with a controller that was full") {
  for (const Phase& phase : phases()) {
    if (phase.steps.empty() || *phase.steps.back().answered == 0 || phase.asked_again != nullptr) continue;
    INFO(phase.name);
    Window window;
    CONTRACT_NEEDS(window, Ability::kRefusal);
    std::vector<Step> steps = phase.steps;
    const Step last = steps.back();
    steps.pop_back();
    if (phase.mode != 0) window.set_mode(phase.mode);
    window.start(phase.request);
    window.exchange(steps);
    window.exchange({{last.sent, ""}});
    window.target().refuse_frames(true);
    window.exchange({{"", last.answered}});
    window.pass(1s);
    window.pass_rest().check_failed(0x05040000);
    window.target().refuse_frames(false);
    window.pass(10ms).expect("605#8000200100000405");
    window.pass(5s).expect_silence();
  }
}

TEST_CASE("[SDO-20] a first frame that could not leave") {
  for (const Phase& phase : phases()) {
    if (!phase.steps.empty()) continue;
    INFO(phase.name);
    Window window;
    CONTRACT_NEEDS(window, Ability::kRefusal);
    if (phase.mode != 0) window.set_mode(phase.mode);
    window.target().refuse_frames(true);
    window.start(phase.request);
    window.pass_nearly(1s);
    CHECK(window.busy());
    window.pass_rest().check_failed(0x05040000);
    window.target().refuse_frames(false);
    window.pass(5s).expect_silence();  // the server knows nothing of it
  }
}

TEST_CASE("[SDO-20] its own abort came first") {
  Window window;
  CONTRACT_NEEDS(window, Ability::kRefusal);
  window.read(5, 0x2000, 1, 128).expect("605#4000200100000000");
  window.target().refuse_frames(true);
  window.arrive("585#4100200114000000", "585#8000200100000206").check_failed(0x06020000);
  window.target().refuse_frames(false);
  window.pass(5s).expect_silence();
}

TEST_CASE("[SDO-21] no abort after an abort") {
  for (const Phase& phase : phases()) {
    INFO(phase.name);
    Window window;
    enter(window, phase);
    for (int i = 0; i < 3; ++i)
      window.arrive("585#8000200100000405").check_failed(0x05040000);
    window.pass(3s).expect_silence();
  }
}
