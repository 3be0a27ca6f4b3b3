// SPDX-License-Identifier: MIT
// The silence between a request and its response (Serial Line V1.02, 2.5.1.1). The CRCs were computed with
// another implementation.
#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using namespace test;

const Bytes kWrite = hex("01 06 00 00 00 07 C8 08");
const Bytes kZero = hex("01 03 02 00 00 B8 44");

static_assert(rtu_silence_us(1200) == 32'084);  // 3.5 * 11 / 1200 s
static_assert(rtu_silence_us(9600) == 4'011);
static_assert(rtu_silence_us(9600, 10) == 3'646);
static_assert(rtu_silence_us(19'200) == 2'006);
static_assert(rtu_silence_us(19'200, 10) == 1'823);
static_assert(rtu_silence_us(19'201) == 1'750);
static_assert(rtu_silence_us(115'200, 10) == 1'750);

/// Time from the last byte of a request to its execution.
struct Delay {
  RtuServer::Settings settings;
  std::uint32_t us;
};

TEST_CASE("RTU: a request is executed after its silence, and a poll before that says how long it takes") {
  const Delay delays[] = {{{}, 1'750},
                          {{.silence_us = 4'011}, 4'011},
                          {{.gap_us = 20'000}, 1'750},
                          {{.response_delay_us = 1'000}, 1'750},
                          {{.response_delay_us = 50'000}, 50'000},
                          {{.silence_us = 0, .gap_us = 1'750}, 0}};
  for (const auto& [settings, us] : delays) {
    INFO(us << " us");
    Line line(settings);
    line.gap();
    line.send(kWrite);
    if (us != 0) {
      CHECK(line.server.poll(line.now) == us);
      CHECK(line.server.poll(line.now + us - 1) == 1);
    }
    CHECK(line.words[0] == 0);
    CHECK(line.server.poll(line.now + us) == 0);
    CHECK(line.server.execute().size() == 8);
    CHECK(line.words[0] == 7);
  }
}

TEST_CASE("RTU: a time from before the last byte is not a long silence") {
  Line line;
  line.send(kWrite);
  CHECK(line.server.poll(line.now - 10) == 1'760);
}

TEST_CASE("RTU: the counter of microseconds may wrap in the silence") {
  Line line;
  line.now = 0xFFFFFFFF - 8 * Line::kByteUs - 100;
  line.send(kRead);
  CHECK(line.server.poll(line.now + 1'749) == 1);
  CHECK(line.response() == kZero);
}

TEST_CASE("RTU: a byte in the silence takes the request back") {
  for (const RtuServer::Settings& settings : {RtuServer::Settings{}, late_port()}) {
    for (const std::uint32_t us : {1u, 96u, 1'749u}) {
      INFO(settings.gap_us << " us, after " << us << " us");
      Line line(settings);
      line.gap();
      line.send(kWrite);
      line.wait(us);
      line.send(hex("00"));
      CHECK(line.server.poll(line.now + 1'750) == RtuServer::kNoRequest);
      CHECK(line.words[0] == 0);
      CHECK(line.server.counters().broken_frames == 1);
      CHECK(line.server.counters().slave_messages == 0);
      line.send(kRead);
      CHECK(line.response().empty() == (settings.gap_us == 0));  // not after a gap
      CHECK(line.server.counters().ignored_bytes == 9);
      CHECK(line.ask(kRead) == kZero);
    }
  }
}

TEST_CASE("RTU: a request that was not executed is replaced by the next one") {
  for (const Bytes& request : {kWrite, hex("01 64 01 CB")}) {
    Line line;
    line.send(request);
    line.gap();
    line.send(kRead);
    CHECK(line.response() == kZero);
    CHECK(line.server.counters().broken_frames == 1);
    CHECK(line.server.counters().foreign_frames == 0);
    CHECK(line.server.counters().slave_messages == 1);
  }
}

TEST_CASE("RTU: a broken byte invalidates the frame that contains it or that it follows, and no other") {
  for (const RtuServer::Settings& settings : {RtuServer::Settings{}, late_port()}) {
    for (std::size_t before = 1; before <= kWrite.size(); ++before) {
      INFO(settings.gap_us << " us, after " << before << " bytes");
      Line line(settings);
      line.gap();
      line.send({kWrite.begin(), kWrite.begin() + static_cast<std::ptrdiff_t>(before)});
      line.server.on_broken_byte(line.now += Line::kByteUs);
      CHECK(line.server.poll(line.now + 1'750) == RtuServer::kNoRequest);
      line.send(kRead);
      CHECK(line.response().empty() == (settings.gap_us == 0));  // not after a gap
      CHECK(line.server.counters().broken_frames == 1);
      CHECK(line.words[0] == 0);
      line.gap();
      line.server.on_broken_byte(line.now += Line::kByteUs);
      line.send(kRead);
      CHECK(line.response() == kZero);
      CHECK(line.server.counters().broken_frames == 1);
    }
  }
}

}  // namespace
}  // namespace cbcan
