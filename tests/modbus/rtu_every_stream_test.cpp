// SPDX-License-Identifier: MIT
// Every stream of bytes and gaps up to a length, every frame of every function code, and every gap between
// and within two frames, on a line whose silence is detected. There the rule is short (Serial Line V1.02, 2.5.1):
// the bytes between two gaps are a frame or nothing. `is_request` is the same rule without states.

#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using namespace test;

constexpr std::size_t kShortest = 4, kLongest = 256;  // Serial Line V1.02, 2.5.1

/// The bytes between two gaps. Plain memory: there are millions of them.
struct Frame {
  std::uint8_t bytes[300];
  std::uint16_t crcs[301] = {0xFFFF};  ///< of its first 0, 1, 2, ... bytes
  std::size_t size = 0;

  void add(std::uint8_t byte) {
    std::uint32_t value = crcs[size] ^ byte;
    for (int bit = 0; bit < 8; ++bit)
      value = (value & 1) != 0 ? value >> 1 ^ 0xA001 : value >> 1;
    bytes[size++] = byte;
    crcs[size] = static_cast<std::uint16_t>(value);
  }
};

/// The length of a request with its CRC (Application Protocol V1.1b3, section 6); 0 = any length.
std::size_t length_of(const Frame& frame) {
  const auto counted = [&frame](std::size_t at) { return frame.size > at ? at + 3 + frame.bytes[at] : 1; };
  switch (frame.bytes[1]) {
    case 1:
    case 2:
    case 3:
    case 4:
    case 5:
    case 6: return 8;
    case 7:
    case 11:
    case 12:
    case 17: return 4;
    case 15:
    case 16: return counted(6);
    case 20:
    case 21: return counted(2);
    case 22: return 10;
    case 23: return counted(10);
    case 24: return 6;
    default: return 0;
  }
}

bool is_request(const Frame& frame) {
  const std::size_t size = frame.size;
  if (size < kShortest || size > kLongest || frame.bytes[0] > 1) return false;
  const std::uint16_t crc = frame.crcs[size - 2];
  if (frame.bytes[size - 2] != crc % 256 || frame.bytes[size - 1] != crc / 256) return false;
  const std::size_t length = length_of(frame);
  return length == 0 ? frame.bytes[0] == 1 : length == size;
}

/// Where silence may go undetected, what comes before the request may be noise.
bool ends_with_request(const Frame& frame) {
  for (std::size_t begin = 1; begin + kShortest <= frame.size; ++begin) {
    Frame end;
    for (std::size_t i = begin; i < frame.size; ++i)
      end.add(frame.bytes[i]);
    if (is_request(end)) return true;
  }
  return false;
}

/// A server, station 1, that is polled after each silence, and the frames that it should receive.
struct StreamLine {
  explicit StreamLine(const RtuServer::Settings& settings = {})
      : server_({&map_, 1}, settings), exact_(settings.gap_us <= settings.silence_us) {
    gap();
  }

  void gap() {
    check_frame();
    now_ += kGapUs;
  }
  void send(std::uint8_t byte) {
    now_ += 96;
    server_.on_byte(byte, now_);
    frame_.add(byte);
  }
  /// The first and the second byte of the right CRC.
  std::uint8_t low() const { return static_cast<std::uint8_t>(frame_.crcs[frame_.size]); }
  std::uint8_t high() const {
    return static_cast<std::uint8_t>(frame_.size == 0 ? 0 : frame_.crcs[frame_.size - 1] >> 8);
  }

  /// False from then on if a request has not been executed or something else has.
  bool good() {
    check_frame();
    return good_;
  }
  std::size_t executed() const { return executed_; }

 private:
  static constexpr std::uint32_t kGapUs = 50'000;

  void check_frame() {
    const bool executed = server_.poll(now_ + 1'750) == 0;
    if (executed) {
      server_.execute();
      server_.on_sent();
    }
    good_ = good_ && (executed == is_request(frame_) || (executed && !exact_ && ends_with_request(frame_)));
    executed_ += executed;
    frame_.size = 0;
  }

  std::array<std::uint16_t, 8> words_{};
  RegisterRange range_{0, words_};
  RegisterMap map_{{&range_, 1}};
  RtuServer server_;
  bool exact_;
  std::uint32_t now_ = 1'000'000;
  Frame frame_;
  bool good_ = true;
  std::size_t executed_ = 0;
};

// ---- Streams

/// The framer compares the station (0, own, other), finds the function code (by length: fixed, by byte count,
/// unknown) and computes a CRC: one byte of each kind, and the two of a right CRC. The numbers are byte counts
/// too.
constexpr int kLow = 256, kHigh = 257;
constexpr int kSymbols[] = {0, 1, 2, 7, kLow, kHigh, 24, 20, 0x41};

/// All streams of `length` of the first `symbols` symbols, with a gap at each bit of `gaps`.
std::size_t check_streams(std::size_t length, std::size_t symbols, unsigned gaps) {
  std::size_t all = 1;
  for (std::size_t i = 0; i < length; ++i)
    all *= symbols;
  StreamLine line;
  for (std::size_t number = 0; number < all; ++number) {
    line.gap();
    for (std::size_t i = 0, rest = number; i < length; ++i, rest /= symbols) {
      if ((gaps >> i & 1) != 0) line.gap();
      const int symbol = kSymbols[rest % symbols];
      line.send(symbol == kLow    ? line.low()
                : symbol == kHigh ? line.high()
                                  : static_cast<std::uint8_t>(symbol));
    }
    if (!line.good()) FAIL("stream " << number << " of " << length << ", gaps " << gaps);
  }
  return line.executed();
}

std::size_t check_all_streams(std::size_t length, std::size_t symbols) {
  std::size_t executed = 0;
  for (unsigned gaps = 0; gaps < 1u << length; gaps += 2)  // there is always one before the first byte
    executed += check_streams(length, symbols, gaps);
  return executed;
}

TEST_CASE("RTU: every stream of up to five bytes of nine kinds and of six of six, with every set of gaps") {
  for (std::size_t length = 1; length <= 5; ++length)
    CHECK((check_all_streams(length, 9) > 0) == (length >= 4));
  CHECK(check_all_streams(6, 6) > 1000);
}

TEST_CASE("RTU: every stream of six bytes of nine kinds and of seven of seven", "[.long]") {
  CHECK(check_all_streams(6, 9) > 10'000);
  CHECK(check_all_streams(7, 7) > 10'000);
}

// ---- Frames

/// One frame of `length` bytes in which every byte count is `count`.
void send_frame(StreamLine& line, std::uint8_t station, std::uint8_t function, std::size_t length,
                std::size_t count, bool right) {
  line.send(station);
  for (std::size_t i = 1; i + 2 < length; ++i)
    line.send(i == 1 ? function : i == 2 || i == 6 || i == 10 ? static_cast<std::uint8_t>(count) : 0x5A);
  line.send(line.low());
  line.send(static_cast<std::uint8_t>(line.high() ^ (right ? 0 : 1)));
}

std::size_t check_frames(StreamLine& line, std::size_t length) {
  const std::size_t before = line.executed();
  for (unsigned function = 0; function < 256; ++function)
    for (std::uint8_t station = 0; station <= 2; ++station)
      for (const std::size_t count : {std::size_t{0}, length - 5, length - 9, length - 13, std::size_t{255}})
        for (const bool right : {false, true}) {
          line.gap();
          send_frame(line, station, static_cast<std::uint8_t>(function), length, count, right);
          if (!line.good()) FAIL("function " << function << " of " << length << " bytes to " << int{station});
        }
  return line.executed() - before;
}

void check_frames_from(std::size_t first, std::size_t last) {
  StreamLine exact, late(test::late_port());
  for (std::size_t length = first; length <= last; ++length)
    for (StreamLine* line : {&exact, &late})
      CHECK((check_frames(*line, length) > 0) == (length >= kShortest && length <= kLongest));
}

TEST_CASE("RTU: every function code in frames of 3 to 16 and 255 to 258 bytes, with right and wrong counts") {
  check_frames_from(3, 16);
  check_frames_from(255, 258);
}

TEST_CASE("RTU: every function code in frames of 3 to 258 bytes", "[.long]") {
  check_frames_from(3, 258);
}

// ---- Cuts

/// With their CRCs, which were computed with another implementation.
const std::vector<Bytes> kFrames{
    hex("01 06 00 00 0B AD 4F 47"),  // for this station
    hex("01 03 00 00 00 01 84 0A"),
    hex("01 07 41 E2"),
    hex("01 41 C0 10"),              // of unknown length
    hex("00 06 00 01 00 03 99 DA"),  // for all
    hex("09 03 00 6B 00 03 75 5F"),  // for another station
    hex("09 03 02 00 05 99 86"),
    hex("09 83 02 41 33"),
};

void check_gaps(const Bytes& both, unsigned gaps) {
  static StreamLine line;
  line.gap();
  for (std::size_t i = 0; i < both.size(); ++i) {
    if ((gaps >> i & 1) != 0) line.gap();
    line.send(both[i]);
  }
  if (!line.good()) FAIL("gaps " << gaps);
}

TEST_CASE("RTU: two frames, with a gap between any two bytes or none, in every combination") {
  for (const Bytes& first : kFrames)
    for (const Bytes& second : kFrames) {
      Bytes both = first;
      both.insert(both.end(), second.begin(), second.end());
      INFO(int{first[0]} << " " << int{first[1]} << ", " << int{second[0]} << " " << int{second[1]});
      for (unsigned gaps = 0; gaps < 1u << both.size(); gaps += 2)
        check_gaps(both, gaps);
    }
}

}  // namespace
}  // namespace cbcan
