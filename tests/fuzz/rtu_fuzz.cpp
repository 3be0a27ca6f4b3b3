// SPDX-License-Identifier: MIT
// Any bytes, whole and broken, at any times to the Modbus RTU server, polls and ends of transmissions in
// between: it answers byte for byte what the model answers, when the model does, and has the model's
// registers and counts afterwards.
//
// The input is a byte of settings and then steps; each is a byte and what belongs to it.

#include "cbcan/modbus/rtu_server.hpp"
#include "fuzz/fuzz.hpp"
#include "fuzz/input.hpp"
#include "fuzz/rtu_model.hpp"

namespace cbcan::fuzz {

namespace {

using Bytes = RtuModel::Bytes;
using View = RtuModel::View;

enum Step : std::uint8_t {
  kBytes,    ///< length, bytes
  kFrame,    ///< length, bytes; they get a CRC
  kLong,     ///< length, bytes, number: they get so many times their last byte, and a CRC
  kWait,     ///< two bytes: microseconds
  kNearGap,  ///< a byte: so much more than 128 microseconds less than a gap
  kPoll,     ///< when the request that waits is to be executed
  kSent,
  kPollSent,
  kPollNow,
  kSteps,
  kBroken = 252  ///< and above: a byte with a parity error; below, steps begin again
};

constexpr std::uint32_t kByteUs = 96;
constexpr std::uint64_t kStart = 0xFFFF0000;  ///< so that the counter of microseconds wraps soon

const std::vector<std::uint16_t> kAtStart = [] {
  std::vector<std::uint16_t> values(ModbusModel::kRegisters);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<std::uint16_t>(i * 40503);
  return values;
}();

RtuModel::Settings settings_of(std::uint8_t choice) {
  struct Times {
    std::uint64_t silence_us, gap_us, response_delay_us;
  };
  constexpr std::array<Times, 4> kTimes{{{1750, 1750, 0}, {1750, 50'000, 0}, {96, 96, 3000}, {0, 0, 0}}};
  const Times& times = kTimes[choice / 2 % 4];
  return {static_cast<std::uint8_t>(choice % 2 != 0 ? 247 : 1),
          times.silence_us,
          times.gap_us,
          times.response_delay_us,
          3800u + choice / 8 % 4,
          choice / 32u,
          choice / 32u % 3};
}

RtuServer::Settings product_settings(const RtuModel::Settings& settings) {
  RtuServer::Settings product;
  product.station = settings.station;
  product.silence_us = static_cast<std::uint32_t>(settings.silence_us);
  product.gap_us = static_cast<std::uint32_t>(settings.gap_us);
  product.response_delay_us = static_cast<std::uint32_t>(settings.response_delay_us);
  return product;
}

std::array<RegisterRange, 3> ranges_of(std::span<std::uint16_t> words, const RtuModel::Settings& settings) {
  const std::size_t fixed = settings.read_only_first;
  const std::size_t missing = fixed + settings.read_only_count;
  const std::size_t rest = missing + settings.missing_count;
  return {{{0, words.first(fixed)},
           {static_cast<std::uint16_t>(fixed), words.subspan(fixed, settings.read_only_count), true},
           {static_cast<std::uint16_t>(rest), words.subspan(rest)}}};
}

struct Run {
  explicit Run(std::uint8_t choice)
      : settings_(settings_of(choice)),
        model_(settings_, kAtStart),
        ranges_(ranges_of(registers_, settings_)),
        server_({&map_, 1}, product_settings(settings_)) {
    // A counter that wraps before the first byte would have begun just then.
    send(Bytes{0xFF});
    wait(gap() + 1);
  }

  void send(View bytes) {
    for (const std::uint8_t byte : bytes) {
      wait(kByteUs);
      server_.on_byte(byte, static_cast<std::uint32_t>(now_));
      model_.receive(byte, now_);
    }
  }
  void send_broken() {
    wait(kByteUs);
    server_.on_broken_byte(static_cast<std::uint32_t>(now_));
    model_.receive_broken(now_);
  }
  void wait(std::uint64_t us) { now_ += us; }
  std::uint64_t gap() const { return settings_.gap_us; }

  /// When the request that waits is to be executed.
  void poll() {
    wait(model_.wait(now_).value_or(0));
    poll_now();
  }
  void poll_now() {
    const std::optional<std::uint64_t> expected_wait = model_.wait(now_);
    const std::uint32_t wait = server_.poll(static_cast<std::uint32_t>(now_));
    require(wait == expected_wait.value_or(RtuServer::kNoRequest),
            "a request is executed when its silence is over");
    if (wait != 0) return;
    require(std::ranges::equal(server_.execute(), model_.execute()),
            "each request has its own response, and nothing else comes");
  }
  void sent() {
    server_.on_sent();
    model_.sent();
  }

  void end() {
    poll();
    sent();
    wait(gap() + 1);
    send(with_crc(Bytes{settings_.station, 3, 0x0E, 0x74, 0, 70}));
    require(model_.wait(now_).has_value() || gap() < kByteUs, "after a gap a request is understood");
    poll();
    require(registers_ == model_.registers(), "the registers are those that were written");
    compare(server_.counters(), model_.counts());
  }

 private:
  static void compare(const RtuServer::Counters& counters, const RtuModel::Counts& counts) {
    require(counters.bus_messages == counts.frames, "right frames are counted");
    require(counters.bus_communication_errors == counts.crc_errors, "wrong CRCs are counted");
    require(counters.slave_exceptions == counts.exceptions, "exceptions are counted");
    require(counters.slave_messages == counts.executed, "requests are counted");
    require(counters.slave_no_responses == counts.unanswered, "broadcasts are counted");
    require(counters.foreign_frames == counts.foreign, "frames of others are counted");
    require(counters.broken_frames == counts.broken, "broken frames are counted");
    require(counters.ignored_bytes == counts.ignored, "ignored bytes are counted");
  }

  RtuModel::Settings settings_;
  RtuModel model_;
  std::vector<std::uint16_t> registers_ = kAtStart;
  std::array<RegisterRange, 3> ranges_;
  RegisterMap map_{ranges_};
  RtuServer server_;
  std::uint64_t now_ = kStart;
};

Bytes lengthened(View bytes, std::size_t more) {
  Bytes result(bytes.begin(), bytes.end());
  result.insert(result.end(), more, bytes.empty() ? 0 : bytes.back());
  return result;
}

void step(Run& run, Input& input) {
  const std::uint8_t step = input.byte();
  if (step >= kBroken) return run.send_broken();
  switch (step % kSteps) {
    case kBytes: return run.send(input.take(input.byte()));
    case kFrame: return run.send(with_crc(input.take(input.byte())));
    case kLong: {
      const View head = input.take(input.byte());
      return run.send(with_crc(lengthened(head, input.byte())));
    }
    case kWait: {
      const std::uint64_t high = input.byte();
      return run.wait(256 * high + input.byte());
    }
    case kNearGap:
      return run.wait(std::max<std::uint64_t>(run.gap() + input.byte(), 128 + kByteUs) - 128 - kByteUs);
    case kPoll: return run.poll();
    case kSent: return run.sent();
    case kPollSent: run.poll(); return run.sent();
    default: return run.poll_now();
  }
}

}  // namespace

}  // namespace cbcan::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cbcan::fuzz::Input input({data, size});
  cbcan::fuzz::Run run(input.byte());
  while (!input.empty())
    cbcan::fuzz::step(run, input);
  run.end();
  return 0;
}
