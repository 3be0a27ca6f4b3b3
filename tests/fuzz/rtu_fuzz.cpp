// SPDX-License-Identifier: MIT
// Any bytes, intact and broken, at any times to the Modbus RTU server, with polls and ends of transmissions
// in between. What it executes is a frame with a right CRC that ends with the last byte; response and
// registers are those of a second implementation.
//
// The input is a byte of settings and then steps; each is a byte and its arguments.

#include "cbcan/modbus/rtu_server.hpp"
#include "fuzz/fuzz.hpp"
#include "fuzz/modbus_model.hpp"
#include "support/modbus_crc.hpp"

namespace cbcan::fuzz {

namespace {

using Bytes = ModbusModel::Bytes;
using View = ModbusModel::View;

enum Step : std::uint8_t {
  kBytes,    ///< length, bytes
  kFrame,    ///< length, bytes; a CRC is added
  kLong,     ///< length, bytes, number: the last byte is repeated so often, and a CRC is added
  kWait,     ///< two bytes: microseconds
  kNearGap,  ///< a byte: a gap minus 128 microseconds, plus this number
  kPoll,     ///< at the time when the waiting request is to be executed
  kSent,
  kPollSent,
  kPollNow,
  kSteps,
  kBroken = 252  ///< and above: a byte with a parity error; below, steps begin again
};

constexpr std::array<std::uint8_t, 3> kAnsweredElsewhere{43, 14,
                                                         1};  ///< the PDU that respond_with() is given

constexpr std::uint32_t kByteUs = 96;
constexpr std::uint64_t kStart = 0xFFFF0000;  ///< so that the counter of microseconds wraps soon

RtuServer::Settings settings_of(std::uint8_t choice) {
  constexpr std::array<RtuServer::Settings, 4> kTimes{
      {{.silence_us = 1750, .gap_us = 1750},
       {.silence_us = 1750, .gap_us = 50'000},
       {.silence_us = 96, .gap_us = 96, .response_delay_us = 3000},
       {.silence_us = 0, .gap_us = 0}}};
  RtuServer::Settings settings = kTimes[choice / 2 % 4];
  settings.station = choice % 2 != 0 ? 247 : 1;
  return settings;
}

Bytes with_crc(View bytes) {
  return test::with_crc(Bytes(bytes.begin(), bytes.end()));
}

/// The response to this frame according to the model; empty for a broadcast.
Bytes response_to(View frame, ModbusModel& model) {
  constexpr std::array<std::uint8_t, 6> kExecuted{3, 4, 6, 16, 22, 23};
  constexpr std::size_t kTcpHead = 7;
  const View pdu = frame.subspan(1, frame.size() - 3);
  if (pdu[0] == kAnsweredElsewhere[0]) return with_crc(Bytes{frame[0], 43, 14, 1});
  Bytes response{frame[0], static_cast<std::uint8_t>(pdu[0] | 0x80), 1};
  if (std::ranges::find(kExecuted, pdu[0]) != kExecuted.end()) response.back() = 3;
  if (response.back() == 3) {
    Bytes request{0, 0, 0, 0, 0, static_cast<std::uint8_t>(pdu.size() + 1), 0};
    request.insert(request.end(), pdu.begin(), pdu.end());
    const std::size_t earlier = model.responses().size();
    model.receive(request);
    const View responses = View(model.responses()).subspan(earlier + kTcpHead);
    response.erase(response.begin() + 1, response.end());
    response.insert(response.end(), responses.begin(), responses.end());
  }
  return frame[0] == 0 ? Bytes{} : with_crc(response);
}

struct Run {
  explicit Run(std::uint8_t choice) : settings_(settings_of(choice)), server_({&map_, 1}, settings_) {
    // Without a first byte the wrap of the counter would look like the start of the line.
    send(Bytes{0xFF});
    wait(gap() + 1);
  }

  void send(View bytes) {
    for (const std::uint8_t byte : bytes) {
      wait(kByteUs);
      server_.on_byte(byte, static_cast<std::uint32_t>(now_));
      if (now_ > last_us_ + gap()) heard_.clear();
      if (!sending_) heard_.push_back(byte);
      last_us_ = now_;
    }
  }
  void send_broken() {
    wait(kByteUs);
    server_.on_broken_byte(static_cast<std::uint32_t>(now_));
    heard_.clear();
    last_us_ = now_;
  }
  void wait(std::uint64_t us) { now_ += us; }
  std::uint64_t gap() const { return settings_.gap_us; }

  /// At the time when the waiting request is to be executed.
  void poll() {
    const std::uint32_t us = poll_now();
    if (us == RtuServer::kNoRequest || us == 0) return;
    wait(us);
    poll_now();
  }
  /// 0 = a request has been taken and executed.
  std::uint32_t poll_now() {
    const std::uint32_t us = server_.poll(static_cast<std::uint32_t>(now_));
    if (us == RtuServer::kNoRequest) return us;
    const std::uint64_t due = last_us_ + std::max(settings_.silence_us, settings_.response_delay_us);
    require(us == (due > now_ ? due - now_ : 0), "a request is executed when its silence is over");
    if (us == 0) execute();
    return us;
  }
  void sent() {
    server_.on_sent();
    sending_ = false;
  }

  void end() {
    poll();
    sent();
    if (gap() > settings_.silence_us) end_without_gap();
    wait(gap() + 1);
    require(understood() || gap() < kByteUs, "after a gap a request is understood");
  }

 private:
  bool understood() {
    const std::uint32_t executed = server_.counters().slave_messages;
    send(with_crc(Bytes{settings_.station, 3, 0x0E, 0x74, 0, 70}));
    poll();
    sent();
    return server_.counters().slave_messages == executed + 1;
  }
  void end_without_gap() {
    constexpr int kMost = 256 / 8 + 1;
    int requests = 0;
    while (++requests <= kMost && !understood())
      wait(settings_.silence_us);
    require(requests <= kMost, "without a gap what was received hides no more than the length of a frame");
  }
  void execute() {
    const View asked = server_.request();
    const Bytes request(asked.begin(), asked.end());
    require(request.size() >= 2 && request.size() <= 254, "a request has the size of a frame");
    require(server_.is_broadcast() == (request[0] == 0) && server_.request_network() == 0,
            "a request is for us");
    const bool reads = server_.request_reads(0, kAtStart.size());
    require(!reads || request[1] == 3 || request[1] == 4 || request[1] == 23, "only some functions read");
    const bool elsewhere = request[1] == kAnsweredElsewhere[0];
    const View bytes = elsewhere ? server_.respond_with(kAnsweredElsewhere) : server_.execute();
    const Bytes response(bytes.begin(), bytes.end());
    const auto explains = [&](std::size_t size) {
      const View frame = View(heard_).last(size);
      if (frame[0] != 0 && frame[0] != settings_.station) return false;
      if (!std::ranges::equal(frame.first(size - 2), request)) return false;
      if (!std::ranges::equal(frame, with_crc(frame.first(size - 2)))) return false;
      ModbusModel after = model_;
      if (response_to(frame, after) != response || after.registers != registers_) return false;
      model_.registers = after.registers;
      return true;
    };
    bool explained = false;
    for (std::size_t size = 4; size <= heard_.size() && size <= 256 && !explained; ++size)
      explained = explains(size);
    require(explained, "a frame with a right CRC is executed and answered, and nothing else");
    heard_.clear();
    sending_ = !response.empty();
  }

  RtuServer::Settings settings_;
  ModbusModel model_{kAtStart};
  std::vector<std::uint16_t> registers_ = kAtStart;
  RegisterRange range_{0, registers_};
  RegisterMap map_{{&range_, 1}};
  RtuServer server_;
  std::uint64_t now_ = kStart, last_us_ = 0;
  Bytes heard_;  ///< since the last gap, while nothing was sent
  bool sending_ = false;
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
    default: run.poll_now();
  }
}

}  // namespace

void run(Input input) {
  Run run(input.byte());
  while (!input.empty())
    step(run, input);
  run.end();
}

}  // namespace cbcan::fuzz
