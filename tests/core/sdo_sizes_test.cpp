// SPDX-License-Identifier: MIT
// Transfers of every size that the caller has memory for: 256 bytes, where a counter of 8 bits is at its end,
// and 65,535, where one of 16 bits is. Node 5, object 2000h.

#include "cbcan/canopen/sdo/client.hpp"
#include "core/sdo_reference.hpp"
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
struct SizedClient final : CanPort {
  explicit SizedClient(std::size_t size)
      : memory(size + 1, 0xEE), client(*this, std::span(memory).first(size)) {}

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

}  // namespace

TEST_CASE("SDO sizes: 256 and 65,535 bytes, each way, in segments and in blocks") {
  const std::size_t size = GENERATE(std::size_t{256}, std::size_t{65535});
  const Mode mode = GENERATE(Mode::kSegmented, Mode::kBlock);
  const bool write = GENERATE(false, true);
  CAPTURE(size, mode, write);
  const Bytes bytes = pattern(size);
  ReferenceServer server({{0x2000, 0, true, true, size, size, 0, ~0u, write ? Bytes(size) : bytes}}, size);
  SizedClient side(size);
  if (write) std::copy(bytes.begin(), bytes.end(), side.memory.begin());
  side.start(write ? Direction::kWrite : Direction::kRead, mode, size);
  for (std::size_t i = 0; i < side.sent.size(); ++i)
    for (const Sdo& response : server.receive(side.sent[i].data))
      side.respond({kResponseId, 8, 0, response});
  CHECK(side.client.outcome() == SdoClient::Outcome::kDone);
  if (!write) CHECK(side.client.size() == size);
  CHECK(side.value() == bytes);
  CHECK(server.object()->value == bytes);
  CHECK(side.is_guarded());
}

TEST_CASE("SDO sizes: a block read that brings more than the server declared, at the end of 16 bits") {
  SizedClient side(65535);
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
  side.respond(frame_of(0xC1, reference_crc(bytes)));  // all seven bytes of the last segment are data
  side.expect(0x80, kObject, 0x05040005);
  CHECK(side.client.outcome() == SdoClient::Outcome::kFailed);
  CHECK(side.is_guarded());
}

TEST_CASE("SDO sizes: nothing is asked for that the memory has no room for") {
  SizedClient side(16);
  for (const Direction direction : {Direction::kRead, Direction::kWrite}) {
    side.start(direction, Mode::kAuto, 17);
    CHECK(side.client.outcome() == SdoClient::Outcome::kFailed);
    CHECK(side.client.error() == AbortCode::kReadLength);
    CHECK(side.sent.empty());
  }
}

TEST_CASE("SDO sizes: an expedited response writes no byte that was not asked for") {
  SizedClient side(4);
  side.start(Direction::kRead, Mode::kAuto, 2);
  side.expect(0x40, kObject);
  side.respond(frame_of(0x4B, kObject, 0x44332211));
  CHECK(side.client.size() == 2);
  CHECK(side.value() == Bytes{0x11, 0x22, 0xEE, 0xEE});
}

}  // namespace cbcan::test
