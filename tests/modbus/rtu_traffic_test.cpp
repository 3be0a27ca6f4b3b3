// SPDX-License-Identifier: MIT
// Random traffic of other stations around ours: requests and responses of every function code, whose data
// contain whole requests for this station, some of them where the CRC of what is before is right. Nothing of
// it is executed, and each request of ours that has its silence is.

#include "modbus/line.hpp"
#include "support/catch.hpp"
#include "support/modbus_crc.hpp"

namespace cbcan {
namespace {

using test::Bytes;
using test::hex;
using test::late_port;
using test::Line;

constexpr int kExchanges = 50'000;

void add_word(Bytes& bytes, std::size_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value >> 8));
  bytes.push_back(static_cast<std::uint8_t>(value));
}

Bytes with_crc(Bytes frame) {
  const std::uint16_t crc = test::modbus_crc(frame);
  frame.push_back(static_cast<std::uint8_t>(crc));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  return frame;
}

struct Traffic {
  Traffic(const RtuServer::Settings& settings, unsigned seed) : line_(settings), chance_(seed) {}

  void run() {
    for (int i = 0; i < kExchanges; ++i) {
      if (one_of(3) == 0)
        ours();
      else
        theirs();
      if (line_.words[kHarmed] != 0 || line_.server.counters().slave_messages != executed_) {
        FAIL("exchange " << i << ": something foreign has been executed");
      }
    }
    CHECK(executed_ > kExchanges / 5);
    CHECK(line_.server.counters().foreign_frames > kExchanges / 2);
  }

 private:
  static constexpr std::size_t kHarmed = 99;
  static constexpr std::size_t kRegister = 7;

  std::size_t one_of(std::size_t count) { return chance_() % count; }
  std::uint8_t byte() { return static_cast<std::uint8_t>(chance_()); }
  bool late() const { return line_.gap_us != Line::kSilenceUs; }

  /// A write and a read of one register, after silence. Without silence it may go unheard.
  void ours() {
    const bool silent = !late() || one_of(4) != 0;
    if (silent)
      line_.gap();
    else
      line_.wait(1'750);
    Bytes request{1, 6};
    add_word(request, kRegister);
    add_word(request, chance_());
    request = with_crc(request);
    line_.send(request);
    const Bytes response = line_.response();
    if (response.empty() && !silent) return;
    if (response != request) FAIL("a request with silence around it has not been executed");
    ++executed_;
  }

  void theirs() {
    const std::uint8_t station =
        static_cast<std::uint8_t>(one_of(8) == 0 ? 1 + 16 * (1 + one_of(14)) : 2 + one_of(3));
    const std::uint8_t function = functions_[one_of(functions_.size())];
    const Bytes asked = request(station, function);
    const std::size_t tries = one_of(10) == 0 ? 2 : 1;
    pause();
    send(asked);
    for (std::size_t i = 1; i < tries; ++i) {
      line_.gap();
      send(asked);
    }
    if (one_of(8) == 0) return line_.gap();  // no response; its master waits
    pause();
    send(one_of(8) == 0 ? with_crc({station, static_cast<std::uint8_t>(function | 0x80), 2})
                        : response(station, function));
  }

  /// With a pause, which is no gap, behind the request that is in it.
  void send(const Bytes& frame) {
    const auto middle = frame.begin() + static_cast<std::ptrdiff_t>(std::min(harm_ends_, frame.size()));
    line_.send(Bytes(frame.begin(), middle));
    const auto longest = line_.gap_us - 1'000;
    line_.now += static_cast<std::uint32_t>(one_of(longest));
    if (line_.server.poll(line_.now) == 0) line_.server.execute();
    line_.send(Bytes(middle, frame.end()));
  }

  /// Between two frames.
  void pause() {
    if (!late() || one_of(4) == 0) return line_.gap();
    line_.wait(static_cast<std::uint32_t>(Line::kByteUs + one_of(2'000)));
  }

  Bytes request(std::uint8_t station, std::uint8_t function) {
    Bytes frame{station, function};
    switch (function) {
      case 7:
      case 11:
      case 12:
      case 17: return with_crc(frame);
      case 1:
      case 2: return two_words(frame, 1 + one_of(2'000));
      case 3:
      case 4: return two_words(frame, 1 + one_of(125));
      case 5:
      case 6: return two_words(frame, chance_());
      case 15:
        return counted(
            frame, 4, [](std::size_t bytes) { return 8 * bytes; }, 246);
      case 16:
        return counted(
            frame, 4, [](std::size_t bytes) { return bytes / 2; }, 246);
      case 20:
      case 21: return data(frame, 7 + one_of(200));
      case 22: add_word(frame, chance_()); return two_words(frame, chance_());
      case 23:
        add_word(frame, chance_());
        add_word(frame, 1 + one_of(125));
        return counted(
            frame, 4, [](std::size_t bytes) { return bytes / 2; }, 242);
      case 24: add_word(frame, chance_()); return with_crc(frame);
      default: return rest(frame, one_of(250));
    }
  }

  Bytes response(std::uint8_t station, std::uint8_t function) {
    Bytes frame{station, function};
    switch (function) {
      case 7: frame.push_back(byte()); return with_crc(frame);
      case 5:
      case 6:
      case 11:
      case 15:
      case 16: return two_words(frame, chance_());
      case 22: add_word(frame, chance_()); return two_words(frame, chance_());
      case 24: frame.push_back(0); return data(frame, 2 + 2 * one_of(32));
      case 1:
      case 2:
      case 12:
      case 17:
      case 20:
      case 21: return data(frame, 1 + one_of(250));
      case 3:
      case 4:
      case 23: return data(frame, 2 + 2 * one_of(125));
      default: return rest(frame, one_of(250));
    }
  }

  Bytes two_words(Bytes frame, std::size_t second) {
    add_word(frame, chance_());
    add_word(frame, second);
    return with_crc(frame);
  }
  /// An address, a quantity that goes with the bytes, and those: an even number of them.
  template <class Quantity>
  Bytes counted(Bytes frame, std::size_t least, Quantity quantity, std::size_t most) {
    const std::size_t bytes = least + 2 * one_of((most - least) / 2 + 1);
    add_word(frame, chance_());
    add_word(frame, quantity(bytes));
    return data(frame, bytes);
  }
  /// A count of bytes, and those.
  Bytes data(Bytes frame, std::size_t bytes) {
    frame.push_back(static_cast<std::uint8_t>(bytes));
    return rest(frame, bytes);
  }

  /// So many bytes and the CRC of it all. If there is room: bytes, which may be the CRC of what is before,
  /// and behind them a request for this station or for all.
  Bytes rest(Bytes frame, std::size_t bytes) {
    const std::size_t begin = frame.size();
    for (std::size_t i = 0; i < bytes; ++i)
      frame.push_back(byte());
    if (bytes >= 10) {
      std::size_t at = begin + one_of(std::min<std::size_t>(bytes - 9, one_of(2) == 0 ? 10 : 250));
      if (one_of(2) == 0) {
        const std::uint16_t crc = test::modbus_crc(std::span(frame).first(at));
        frame[at] = static_cast<std::uint8_t>(crc);
        frame[at + 1] = static_cast<std::uint8_t>(crc >> 8);
      }
      harm_ends_ = at + 10;
      std::ranges::copy(harms_[one_of(harms_.size())], frame.begin() + static_cast<std::ptrdiff_t>(at + 2));
    }
    return with_crc(frame);
  }

  Line line_;
  std::mt19937 chance_;
  std::uint32_t executed_ = 0;
  std::size_t harm_ends_ = 0;  ///< in the frame made last
  const Bytes functions_{1,  2,  3,  3,  3,  4,  5,  6,  7,  8,  11, 12,  15, 16,
                         16, 16, 17, 20, 21, 22, 23, 23, 24, 43, 65, 100, 127};
  const std::array<Bytes, 2> harms_{with_crc({1, 6, 0, kHarmed, 0x0B, 0xAD}),
                                    with_crc({0, 6, 0, kHarmed, 0x0B, 0xAD})};
};

TEST_CASE("RTU: nothing of other stations' traffic is executed, and nothing of ours is lost") {
  SECTION("where the port's times are exact") {
    Traffic({}, 1).run();
  }
  SECTION("where bytes come late") {
    Traffic(late_port(), 2).run();
  }
}

}  // namespace
}  // namespace cbcan
