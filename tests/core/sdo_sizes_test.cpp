// SPDX-License-Identifier: MIT
// Transfers of every size that the caller has memory for: 256 bytes, where a counter of 8 bits is at its end,
// and 65,535, where one of 16 bits is. The server is played by hand; node 5, object 2000h.

#include "cbcan/canopen/sdo/client.hpp"
#include "support/bench.hpp"

namespace cbcan::test {
namespace {

using Direction = SdoClient::Direction;
using Mode = SdoClient::Mode;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t kResponseId = 0x585;

/// No two blocks of it are alike.
std::uint8_t byte_at(std::size_t i) {
  return static_cast<std::uint8_t>(i * 7 + i / 251 + i / 65);
}

Bytes pattern(std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i)
    bytes[i] = byte_at(i);
  return bytes;
}

unsigned crc_of(const Bytes& bytes) {
  unsigned crc = 0;
  for (const unsigned byte : bytes) {
    crc ^= byte << 8;
    for (int bit = 0; bit < 8; ++bit)
      crc = ((crc & 0x8000) != 0 ? crc << 1 ^ 0x1021 : crc << 1) & 0xFFFF;
  }
  return crc;
}

/// Command, bytes 1..3, bytes 4..7.
Frame frame_of(unsigned command, std::uint32_t middle = 0, std::uint32_t tail = 0) {
  Frame frame;
  frame.id = kResponseId;
  frame.length = 8;
  frame.data[0] = static_cast<std::uint8_t>(command);
  for (unsigned i = 0; i < 3; ++i)
    frame.data[1 + i] = static_cast<std::uint8_t>(middle >> 8 * i);
  for (unsigned i = 0; i < 4; ++i)
    frame.data[4 + i] = static_cast<std::uint8_t>(tail >> 8 * i);
  return frame;
}

constexpr std::uint32_t kObject = 0x002000;

/// Seven bytes of a value from `at` on, those behind its end as 0.
Frame segment_of(const Bytes& bytes, std::size_t at, unsigned command) {
  Frame frame = frame_of(command);
  for (std::size_t i = 0; i < 7 && at + i < bytes.size(); ++i)
    frame.data[1 + i] = bytes[at + i];
  return frame;
}

/// The client's side: the last frame that it has sent, and memory with a guard behind it.
struct Client final : CanPort {
  explicit Client(std::size_t size) : memory(size + 1, 0xEE), client(*this, std::span(memory).first(size)) {}

  bool try_send(const Frame& frame) override {
    sent.push_back(frame);
    return true;
  }
  /// The only frame since the last call.
  Frame only() {
    REQUIRE(sent.size() == 1);
    const Frame frame = sent[0];
    sent.clear();
    REQUIRE(frame.id == 0x605);
    return frame;
  }
  void expect(unsigned command, std::uint32_t middle = 0, std::uint32_t tail = 0) {
    Frame expected = frame_of(command, middle, tail);
    expected.id = 0x605;
    REQUIRE(text_of(only()) == text_of(expected));
  }
  void respond(const Frame& frame) { client.on_frame(frame, 0); }
  void start(Direction direction, Mode mode, std::size_t size) {
    client.start({5, 0, 0x2000, static_cast<std::uint16_t>(size), direction, mode}, 0);
  }
  Bytes value() const { return {memory.begin(), memory.end() - 1}; }
  bool is_guarded() const { return memory.back() == 0xEE; }

  std::vector<Frame> sent;
  Bytes memory;
  SdoClient client;
};

constexpr std::size_t kSizes[] = {256, 65535};

}  // namespace

TEST_CASE("SDO sizes: a segmented read fills what the caller gave") {
  for (const std::size_t size : kSizes) {
    const Bytes bytes = pattern(size);
    Client side(size);
    side.start(Direction::kRead, Mode::kSegmented, size);
    side.expect(0x40, kObject);
    side.respond(frame_of(0x41, kObject, static_cast<std::uint32_t>(size)));
    unsigned toggle = 0;
    for (std::size_t at = 0; at < size; at += 7, toggle ^= 0x10) {
      side.expect(0x60 | toggle);
      const std::size_t count = std::min<std::size_t>(7, size - at);
      const unsigned last = at + count == size ? 1 : 0;
      side.respond(segment_of(bytes, at, toggle | static_cast<unsigned>(7 - count) << 1 | last));
    }
    CHECK(side.client.outcome() == SdoClient::Outcome::kDone);
    CHECK(side.client.size() == size);
    CHECK(side.value() == bytes);
    CHECK(side.is_guarded());
  }
}

TEST_CASE("SDO sizes: a segmented write sends all of it") {
  for (const std::size_t size : kSizes) {
    const Bytes bytes = pattern(size);
    Client side(size);
    std::copy(bytes.begin(), bytes.end(), side.memory.begin());
    side.start(Direction::kWrite, Mode::kSegmented, size);
    side.expect(0x21, kObject, static_cast<std::uint32_t>(size));
    side.respond(frame_of(0x60, kObject));
    unsigned toggle = 0;
    for (std::size_t at = 0; at < size; at += 7, toggle ^= 0x10) {
      const std::size_t count = std::min<std::size_t>(7, size - at);
      const unsigned last = at + count == size ? 1 : 0;
      const Frame segment = side.only();
      REQUIRE(segment.data ==
              segment_of(bytes, at, toggle | static_cast<unsigned>(7 - count) << 1 | last).data);
      side.respond(frame_of(0x20 | toggle));
    }
    CHECK(side.client.outcome() == SdoClient::Outcome::kDone);
    CHECK(side.sent.empty());
  }
}

TEST_CASE("SDO sizes: a block read asks for as many segments as fit, 64 at most") {
  for (const std::size_t size : kSizes) {
    const Bytes bytes = pattern(size);
    const unsigned block = size == 256 ? 37 : 64;  // 37 * 7 = 259
    Client side(size);
    side.start(Direction::kRead, Mode::kBlock, size);
    side.expect(0xA4, kObject, block);
    side.respond(frame_of(0xC6, kObject, static_cast<std::uint32_t>(size)));
    side.expect(0xA3);
    for (std::size_t at = 0; at < size;) {
      unsigned sequence = 0;
      for (; sequence < block && at < size; at += 7) {
        const unsigned last = at + 7 >= size ? 0x80 : 0;
        side.respond(segment_of(bytes, at, ++sequence | last));
      }
      side.expect(0xA2, sequence | block << 8);
    }
    const auto unused = static_cast<unsigned>((7 - size % 7) % 7);
    side.respond(frame_of(0xC1 | unused << 2, crc_of(bytes)));
    side.expect(0xA1);
    CHECK(side.client.outcome() == SdoClient::Outcome::kDone);
    CHECK(side.client.size() == size);
    CHECK(side.value() == bytes);
    CHECK(side.is_guarded());
  }
}

TEST_CASE("SDO sizes: a block write sends all of it, in blocks as the server wants them") {
  for (const std::size_t size : kSizes) {
    const Bytes bytes = pattern(size);
    constexpr unsigned kBlock = 100;
    Client side(size);
    std::copy(bytes.begin(), bytes.end(), side.memory.begin());
    side.start(Direction::kWrite, Mode::kBlock, size);
    side.expect(0xC6, kObject, static_cast<std::uint32_t>(size));
    side.respond(frame_of(0xA4, kObject, kBlock));
    for (std::size_t at = 0; at < size;) {
      const std::vector<Frame> segments = std::exchange(side.sent, {});
      REQUIRE(segments.size() == std::min<std::size_t>(kBlock, (size - at + 6) / 7));
      unsigned sequence = 0;
      for (const Frame& segment : segments) {
        const unsigned last = at + 7 >= size ? 0x80 : 0;
        REQUIRE(segment.data == segment_of(bytes, at, ++sequence | last).data);
        at += 7;
      }
      side.respond(frame_of(0xA2, sequence | kBlock << 8));
    }
    const auto unused = static_cast<unsigned>((7 - size % 7) % 7);
    side.expect(0xC1 | unused << 2, crc_of(bytes));
    side.respond(frame_of(0xA1));
    CHECK(side.client.outcome() == SdoClient::Outcome::kDone);
  }
}

TEST_CASE("SDO sizes: a block read that brings more than the server declared, at the end of 16 bits") {
  Client side(65535);
  const Bytes bytes = pattern(65541);
  side.start(Direction::kRead, Mode::kBlock, 65535);
  side.expect(0xA4, kObject, 64);
  side.respond(frame_of(0xC4, kObject));  // without a size
  side.expect(0xA3);
  for (std::size_t at = 0; at < 65541;) {
    unsigned sequence = 0;
    for (; sequence < 64 && at < 65541; at += 7) {
      const unsigned last = at + 7 >= 65541 ? 0x80 : 0;
      side.respond(segment_of(bytes, at, ++sequence | last));
    }
    side.expect(0xA2, sequence | 64u << 8);
  }
  side.respond(frame_of(0xC1, crc_of(bytes)));  // all seven bytes of the last segment are data
  side.expect(0x80, kObject, 0x05040005);
  CHECK(side.client.outcome() == SdoClient::Outcome::kFailed);
  CHECK(side.is_guarded());
}

TEST_CASE("SDO sizes: nothing is asked for that the memory has no room for") {
  Client side(16);
  for (const Direction direction : {Direction::kRead, Direction::kWrite}) {
    side.start(direction, Mode::kAuto, 17);
    CHECK(side.client.outcome() == SdoClient::Outcome::kFailed);
    CHECK(side.client.error() == AbortCode::kReadLength);
    CHECK(side.sent.empty());
  }
}

TEST_CASE("SDO sizes: an expedited response writes no byte that was not asked for") {
  Client side(4);
  side.start(Direction::kRead, Mode::kAuto, 2);
  side.expect(0x40, kObject);
  side.respond(frame_of(0x4B, kObject, 0x44332211));
  CHECK(side.client.size() == 2);
  CHECK(side.value() == Bytes{0x11, 0x22, 0xEE, 0xEE});
}

}  // namespace cbcan::test
