// SPDX-License-Identifier: MIT
// SDO transfers of which each frame in turn is lost, repeated or late, with a CRC, a size, both or neither.
// One that fails changes no value.

#include "core/reference_server.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

namespace {

/// At the limits of a segment, and of sub-blocks of 64 and of 127 segments; 600 is between.
constexpr std::uint16_t kSizes[] = {1, 7, 8, 14, 448, 449, 600, 889, 890, 897};
/// Memory for a value: data that arrive twice fit too.
constexpr std::uint16_t kRoom = 2000;
const SdoBytes kBefore{0xEE};

SdoBytes value_of(std::uint16_t size) {
  SdoBytes value(size);
  for (std::size_t i = 0; i < size; ++i)
    value[i] = static_cast<std::uint8_t>(i * 7 + i / 251 + i / 65);  // all blocks are different
  return value;
}

struct FramePort final : CanPort {
  bool try_send(const Frame& frame) override {
    sent.push_back(frame.data);
    return true;
  }
  std::vector<Sdo> sent;
};

struct Server {
  explicit Server(const SdoBytes& value) {
    server.reset(0x585);
    dictionary.write(0x2000, 0, value, 0);
  }
  std::vector<Sdo> receive(const Sdo& request) {
    server.on_frame({0x605, 8, 0, request}, 0);
    return std::exchange(port.sent, {});
  }
  SdoBytes value() {
    std::size_t size = 0;
    dictionary.read(0x2000, 0, buffer, size, 0);
    return SdoBytes(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
  }

  const std::vector<ObjectEntry> entries{
      {0x2000, 0, 0, DataType::kDomain, 0, ObjectFlags::kReadWrite | ObjectFlags::kVariable, 4, kRoom}};
  SdoBytes values = SdoBytes(kRoom + 4u), buffer = SdoBytes(kRoom);
  FramePort port;
  ObjectDictionary dictionary{entries, values, nullptr, {}};
  SdoServer server{dictionary, port, buffer};
};

enum class Fault { kLost, kRepeated, kLate };

struct Kind {
  SdoClient::Mode mode;
  bool crc, sized;  ///< client and server have agreed on them
};
constexpr auto kInBlocks = SdoClient::Mode::kBlock, kInSegments = SdoClient::Mode::kSegmented;
constexpr Kind kKinds[] = {{kInBlocks, false, false},   {kInBlocks, false, true},
                           {kInBlocks, true, false},    {kInBlocks, true, true},
                           {kInSegments, false, false}, {kInSegments, false, true}};

/// A transfer with a fault at its `place`-th frame.
struct LossyTransfer {
  void run(SdoClient::Direction direction, const SdoBytes& value) {
    const auto size = static_cast<std::uint16_t>(value.size());
    const bool write = direction == SdoClient::Direction::kWrite;
    if (write) std::copy(value.begin(), value.end(), memory.begin());
    client.start({5, 0, 0x2000, write ? size : kRoom, direction, kind.mode}, now);
    while (client.busy()) {
      if (!port.sent.empty()) {
        ask();
      } else if (!responses.empty() && responses.front().first <= client.deadline()) {
        answer();
      } else {
        client.poll(now = std::max(now, client.deadline()));
      }
    }
    while (!port.sent.empty())
      ask();
  }
  bool done() const { return client.outcome() == SdoClient::Outcome::kDone; }
  bool has_right_value(SdoClient::Direction direction, const SdoBytes& value) {
    if (direction == SdoClient::Direction::kRead)
      return !done() ||
             (client.size() == value.size() && std::equal(value.begin(), value.end(), memory.begin()));
    return server.value() == value || (server.value() == kBefore && !done());
  }

  void ask() {
    Sdo request = port.sent.front();
    port.sent.erase(port.sent.begin());
    if (frames == 0 && !kind.crc && request[0] >= 0xA0) request[0] &= 0xFB;
    if (frames == 0 && !kind.sized && (request[0] == 0x21 || request[0] >= 0xC0))
      request = {static_cast<std::uint8_t>(request[0] & 0xFC), 0, 0x20};
    for (unsigned times = copies(); times != 0; --times)
      for (const Sdo& response : server.receive(request))
        send(response);
  }
  void send(Sdo response) {
    const bool initiates =
        (response[0] == 0xC2 || response[0] == 0xC6 || response[0] == 0x41) && response[2] == 0x20;
    if (initiates && !kind.crc && response[0] >= 0xC0) response[0] &= 0xFB;
    if (initiates && !kind.sized) response = {static_cast<std::uint8_t>(response[0] & 0xFC), 0, 0x20};
    if (fault == Fault::kLate && frames == place) paused_until = now + 600 * kMillisecond;
    for (unsigned times = copies(); times != 0; --times)
      responses.emplace_back(std::max(now, paused_until), response);
  }
  void answer() {
    const auto [at, response] = responses.front();
    responses.pop_front();
    client.on_frame({0x585, 8, 0, response}, now = std::max(now, at));
  }
  unsigned copies() {
    if (frames++ != place) return 1;
    return fault == Fault::kLost ? 0 : fault == Fault::kRepeated ? 2 : 1;
  }

  Kind kind;
  Fault fault;
  std::size_t place;
  Server server;
  std::size_t frames = 0;
  Time now = 0, paused_until = 0;
  SdoBytes memory = SdoBytes(kRoom);
  std::deque<std::pair<Time, Sdo>> responses{};  ///< with the times at which they arrive
  FramePort port{};
  SdoClient client{port, memory};
};

}  // namespace

TEST_CASE("SDO: with one frame lost, repeated or late, a transfer that is done has the right value") {
  const auto direction = GENERATE(SdoClient::Direction::kRead, SdoClient::Direction::kWrite);
  const bool write = direction == SdoClient::Direction::kWrite;
  std::size_t done = 0;
  for (const Kind& kind : kKinds)
    for (const std::uint16_t size : kSizes)
      for (const Fault fault : {Fault::kLost, Fault::kRepeated, Fault::kLate})
        for (std::size_t place = 0, frames = 1; place < frames; ++place) {
          const SdoBytes value = value_of(size);
          LossyTransfer transfer{kind, fault, place, Server(write ? kBefore : value)};
          transfer.run(direction, value);
          frames = transfer.frames;
          if (transfer.done()) ++done;
          if (transfer.has_right_value(direction, value)) continue;
          CAPTURE(kind.mode == kInBlocks, kind.crc, kind.sized, size, static_cast<int>(fault), place, frames);
          CHECK(false);
        }
  CHECK(done == (write ? 10'091 : 10'242));  // the others fail
}

TEST_CASE("SDO server: a frame repeated at the beginning of a sub-block is not acknowledged") {
  Server server(kBefore);
  const Sdo request{0xC0, 0, 0x20};  // with neither CRC nor size; as a segment it is number 64, the last
  CHECK(server.receive(request) == std::vector<Sdo>{{0xA4, 0, 0x20, 0, 64}});
  CHECK(server.receive(request).empty());
  for (std::uint8_t sequence = 1; sequence < 64; ++sequence)
    CHECK(server.receive({sequence, 1}).empty());
  CHECK(server.receive({64, 2}) == std::vector<Sdo>{{0xA2, 64, 64}});
  CHECK(server.receive({64, 2}).empty());
  CHECK(server.receive({1, 3}).empty());
  CHECK(server.receive({0x82, 4}) == std::vector<Sdo>{{0xA2, 2, 64}});
  CHECK(server.receive({0x82, 4}).empty());
  CHECK(server.receive({0xC1}) == std::vector<Sdo>{{0xA1}});
  CHECK(server.value().size() == 66 * 7);
}

}  // namespace cbcan::test
