// SPDX-License-Identifier: MIT
// The SDO server compared with a second one, with random frames: requests that continue the current transfer,
// nearly such requests, and any others. The responses must be the same, byte for byte. Also the SDO client with
// the second server, with sizes at the limits of 8-bit and 16-bit counters.

#include "core/reference_server.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

namespace {

using State = ReferenceServer::State;

constexpr std::size_t kBuffer = 1000;
constexpr std::uint16_t kReadWrite = ObjectFlags::kReadWrite, kVariable = ObjectFlags::kVariable;

const std::vector<ObjectEntry> kReferenceEntries{
    {0x2000, 0, 0, DataType::kUnsigned8, 0, kReadWrite, 0, 1},
    {0x2000, 1, 2, DataType::kUnsigned32, 0, kReadWrite, 1, 4},
    {0x2001, 0, 0, DataType::kUnsigned64, 0, kReadWrite, 9, 8},
    {0x2002, 0, 0, DataType::kVisibleString, 0, ObjectFlags::kRead, 17, 30},
    {0x2003, 0, 0, DataType::kUnsigned16, 0, ObjectFlags::kWrite, 47, 2},
    {0x2004, 0, 0, DataType::kUnsigned16, 0, kReadWrite | ObjectFlags::kLimited, 49, 2},
    {0x2005, 0, 0, DataType::kDomain, 0, kReadWrite | kVariable, 55, 40},
    {0x2006, 0, 0, DataType::kDomain, 0, kReadWrite | kVariable, 99, 1000},
    {0x2007, 0, 0, DataType::kDomain, 0, kReadWrite, 1099, 1001},
    {0x2008, 0, 0, DataType::kDomain, 0, kReadWrite, 2100, 21},
};
constexpr std::size_t kValues = 2121;
const std::vector<ObjectLimits> kReferenceLimits{{0x2004, 0, 10, 1000}};

std::vector<ReferenceObject> objects() {
  constexpr unsigned kMost = 0xFFFFFFFF;
  const auto zeros = [](std::size_t size) { return SdoBytes(size); };
  return {{0x2000, 0, true, true, 1, 1, 0, kMost, zeros(1)},
          {0x2000, 1, true, true, 4, 4, 0, kMost, zeros(4)},
          {0x2000, 2, true, true, 4, 4, 0, kMost, zeros(4)},
          {0x2001, 0, true, true, 8, 8, 0, kMost, zeros(8)},
          {0x2002, 0, true, false, 30, 30, 0, kMost, zeros(30)},
          {0x2003, 0, false, true, 2, 2, 0, kMost, zeros(2)},
          {0x2004, 0, true, true, 2, 2, 10, 1000, zeros(2)},
          {0x2005, 0, true, true, 0, 40, 0, kMost, {}},
          {0x2006, 0, true, true, 0, 1000, 0, kMost, {}},
          {0x2007, 0, true, true, 1001, 1001, 0, kMost, zeros(1001)},
          {0x2008, 0, true, true, 21, 21, 0, kMost, zeros(21)}};
}

/// Generates the next request of a client.
struct Client {
  Client(const ReferenceServer& server, unsigned seed) : server_(server), chance_(seed) {}

  std::size_t one_of(std::size_t count) { return chance_() % count; }

  Sdo next() {
    Sdo frame = one_of(40) == 0 ? anything() : plausible();
    if (one_of(30) == 0) frame[one_of(8)] = byte();
    if (one_of(60) == 0) frame[0] = static_cast<std::uint8_t>(frame[0] ^ 1 << one_of(8));
    return frame;
  }

 private:
  Sdo plausible() {
    switch (server_.state()) {
      case State::kDownload: return download_segment();
      case State::kUpload: return with(0x60 + 16 * server_.toggle());
      case State::kBlockDownload: return block_segment();
      case State::kBlockDownloadEnd: return end_of_block();
      case State::kBlockUploadStart: return with(0xA3);
      case State::kBlockUpload: return acknowledge();
      case State::kBlockUploadEnd: return with(0xA1);
      default: return initiate();
    }
  }
  /// The remaining bytes of the object.
  std::size_t left() const {
    const std::size_t longest = server_.object()->longest;
    return longest - std::min(longest, server_.bytes().size());
  }
  Sdo initiate() {
    constexpr unsigned kSubs[] = {0, 0, 0, 1, 2, 3};
    const unsigned index = 0x2000 + static_cast<unsigned>(one_of(10));
    Sdo frame = with(command());
    frame[1] = static_cast<std::uint8_t>(index);
    frame[2] = static_cast<std::uint8_t>(index >> 8);
    frame[3] = static_cast<std::uint8_t>(index == 0x2000 ? kSubs[one_of(6)] : one_of(50) == 0);
    const unsigned sizes[] = {1, 2, 4, 8, 9, 21, 30, 40, 1000, 1001};
    const unsigned size = one_of(3) == 0 ? static_cast<unsigned>(one_of(1100)) : sizes[index - 0x2000];
    const bool is_size = (frame[0] & 0xE3) == 0x21 || (frame[0] & 0xE3) == 0xC2;
    if (is_size)
      frame = {frame[0],
               frame[1],
               frame[2],
               frame[3],
               static_cast<std::uint8_t>(size),
               static_cast<std::uint8_t>(size >> 8)};
    if (index == 0x2004 && !is_size) {
      frame[5] = static_cast<std::uint8_t>(one_of(5));
      if (one_of(2) == 0) frame[4] = static_cast<std::uint8_t>(one_of(12));
    }
    if (frame[0] / 32 == 5)
      frame[4] = static_cast<std::uint8_t>(one_of(2) == 0 ? 1 + one_of(5) : one_of(140));
    return frame;
  }
  unsigned command() {
    constexpr unsigned kCommands[] = {0x20, 0x21, 0x22, 0x23, 0x27, 0x2B, 0x2F, 0x40,
                                      0x40, 0xA0, 0xA4, 0xC0, 0xC2, 0xC4, 0xC6};
    return kCommands[one_of(15)];
  }
  Sdo download_segment() {
    const std::size_t size = one_of(5) == 0 ? one_of(8) : std::min<std::size_t>(7, left());
    const bool last = size == left() || one_of(20) == 0;
    return with(16 * server_.toggle() + 2 * (7 - static_cast<unsigned>(size)) + last);
  }
  /// Sometimes one is lost.
  Sdo block_segment() {
    const unsigned number = server_.sequence() + 1 + (one_of(40) == 0);
    return with(number + (left() <= 7 || one_of(30) == 0 ? 128 : 0));
  }
  Sdo end_of_block() {
    const SdoBytes& bytes = server_.bytes();
    const std::size_t longest = server_.object()->longest;
    const std::size_t unused = bytes.size() > longest ? bytes.size() - longest : one_of(8);
    const unsigned crc =
        reference_crc(SdoBytes(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(unused % 8)));
    Sdo frame = with(0xC1 + 4 * static_cast<unsigned>(unused % 8));
    frame[1] = static_cast<std::uint8_t>(crc);
    frame[2] = static_cast<std::uint8_t>(crc >> 8);
    return frame;
  }
  Sdo acknowledge() {
    Sdo frame = with(0xA2);
    const std::size_t sent = server_.sequence();
    const std::size_t kind = one_of(10);
    frame[1] = static_cast<std::uint8_t>(kind == 0 ? one_of(sent + 2) : kind < 3 ? 0 : sent);
    frame[2] = static_cast<std::uint8_t>(one_of(30) == 0 ? one_of(140) : 1 + one_of(20));
    return frame;
  }

  std::uint8_t byte() { return static_cast<std::uint8_t>(chance_()); }
  Sdo anything() {
    Sdo frame;
    for (std::uint8_t& each : frame)
      each = byte();
    return frame;
  }
  Sdo with(unsigned command) {
    Sdo frame = anything();
    frame[0] = static_cast<std::uint8_t>(command);
    return frame;
  }

  const ReferenceServer& server_;
  std::mt19937 chance_;
};

std::string text(const Sdo& bytes) {
  Frame frame;
  frame.id = 0x5C2;
  frame.length = 8;
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return text_of(frame);
}

struct Beside {
  explicit Beside(unsigned seed) : client(reference, seed) { server.reset(0x5C2); }

  void run(std::size_t frames) {
    for (std::size_t i = 0; i < frames; ++i) {
      const Sdo request = client.next();
      one(request);
      if (client.one_of(100) == 0) ignored(request);
    }
  }
  void one(const Sdo& request) {
    Frame frame;
    frame.id = 0x642;
    frame.length = 8;
    frame.data = request;
    asked.push_back(text_of(frame));
    if (asked.size() > 8) asked.pop_front();
    port.sent.clear();
    server.on_frame(frame, 0);
    std::deque<std::string> expected;
    for (const Sdo& response : reference.receive(request)) {
      aborts += response[0] == 0x80;
      expected.push_back(text(response));
      ++seen[response[0] == 0x80 ? expected.back().substr(12) : "responses"];
    }
    if (port.sent != expected) differ(expected);
  }
  /// Not a request: too short, of 29 bits, remote.
  void ignored(const Sdo& request) {
    Frame frame{0x642, 8, 0, request};
    const std::size_t kind = client.one_of(3);
    if (kind == 0) frame.length = static_cast<std::uint8_t>(client.one_of(8));
    if (kind == 1) frame.flags = Frame::kExtended;
    if (kind == 2) frame.flags = Frame::kRemote;
    port.sent.clear();
    server.on_frame(frame, 0);
    ++unheard;
    if (!port.sent.empty()) differ({});
  }
  void differ(const std::deque<std::string>& expected) {
    for (const std::string& request : asked)
      UNSCOPED_INFO(request);
    for (const std::string& response : expected)
      UNSCOPED_INFO("expected " << response);
    for (const std::string& response : port.sent)
      UNSCOPED_INFO("was      " << response);
    FAIL("not the same");
  }

  std::vector<std::uint8_t> values = std::vector<std::uint8_t>(kValues);
  std::vector<std::uint8_t> buffer = std::vector<std::uint8_t>(kBuffer);
  RecordingPort port;
  ObjectDictionary dictionary{kReferenceEntries, values, nullptr, kReferenceLimits};
  SdoServer server{dictionary, port, buffer};
  ReferenceServer reference{objects(), kBuffer};
  Client client;
  std::deque<std::string> asked;
  std::uint32_t aborts = 0, unheard = 0;
  std::map<std::string, std::size_t> seen;  ///< responses, and aborts by the code's bytes
};

}  // namespace

TEST_CASE("SDO server: 100,000 random frames, each response that of a second implementation") {
  Beside beside(1);
  beside.run(100'000);
  // Each abort code that a server has, low byte first, often enough.
  for (const char* code :
       {"00000305", "01000405", "02000405", "03000405", "04000405", "05000405", "01000106", "02000106",
        "00000206", "10000706", "12000706", "11000906", "31000906", "32000906"}) {
    INFO(code);
    CHECK(beside.seen[code] >= 10);
  }
  CHECK(beside.seen["responses"] > 50'000);
  CHECK(beside.server.counters().aborts_sent == beside.aborts);
  CHECK(beside.server.counters().ignored == beside.unheard);
  CHECK(beside.server.counters().aborts_received > 100);
  CHECK(beside.server.counters().aborts_received < 100'000);
  CHECK(beside.server.counters().requests > 10'000);
}

TEST_CASE("SDO server: eight sub-blocks in a row without an accepted segment, counted from 0 in each upload") {
  Beside beside(1);
  for (const int sub_blocks : {7, 8}) {
    beside.one({0xA4, 0x02, 0x20, 0, 1});  // one segment at a time
    beside.one({0xA3});
    for (int i = 0; i < sub_blocks; ++i)
      beside.one({0xA2, 0, 1});
  }
  CHECK(beside.seen["03000405"] == 1);
}

TEST_CASE("SDO server: what the port refuses is sent later, in order") {
  Beside beside(1);
  const auto ask = [&](const char* request, unsigned refused) {
    beside.port.refuse_next = refused;
    beside.server.on_frame(frame_from(request), 0);
    CHECK(beside.port.sent.empty());
    for (unsigned i = 0; i < refused; ++i)
      beside.server.poll(beside.server.deadline());
    return std::exchange(beside.port.sent, {});
  };
  using Sent = std::deque<std::string>;
  CHECK(ask("642#A402200002000000", 1) == Sent{"5C2#C60220001E000000"});
  CHECK(ask("642#A300000000000000", 2) == Sent{"5C2#0100000000000000", "5C2#0200000000000000"});
  CHECK(beside.server.deadline() == kNever);
}

TEST_CASE(
    "SDO server: a block download waits for its client as long as the setting says, any other transfer for "
    "ever") {
  Beside beside(1);
  SdoServer& server = beside.server;
  const auto ask = [&](const char* request, Time now) { server.on_frame(frame_from(request), now); };
  SECTION("for its next frame") {
    ask("642#C206200008000000", 0);
    ask("642#0101020304050607", 700'000);
    CHECK(server.deadline() == 1'700'001);
    server.poll(1'700'000);
    ask("642#8208000000000000", 1'700'000);
    server.poll(2'700'000);
    CHECK(beside.port.sent == std::deque<std::string>{"5C2#A40620007F000000", "5C2#A2027F0000000000"});
    server.poll(2'700'001);
    CHECK(beside.port.sent.back() == "5C2#8006200000000405");
    CHECK(server.deadline() == kNever);
    ask("642#4000200000000000", 2'700'001);
    CHECK(beside.port.sent.back() == "5C2#4F00200000000000");
  }
  SECTION("not while the port has no room for the response") {
    beside.port.refuse_next = 15'000;
    ask("642#C206200008000000", 0);
    while (beside.port.sent.empty())
      server.poll(server.deadline());
    CHECK(beside.port.sent == std::deque<std::string>{"5C2#A40620007F000000"});
    CHECK(server.deadline() == 2'500'001);  // 1.5 s later, and a second
  }
  SECTION("0: without limit") {
    server.set_block_timeout(0);
    ask("642#C206200008000000", 0);
    CHECK(server.deadline() == kNever);
  }
  SECTION("until its end, an abort or a reset") {
    const auto* end = GENERATE("642#8000000000000000", "642#0000000000000000", "");
    ask("642#C206200008000000", 0);
    *end == 0 ? server.reset(0x5C2) : ask(end, 1);
    CHECK(server.deadline() == kNever);
  }
  SECTION("others") {
    const auto* request = GENERATE("642#2106200008000000", "642#4002200000000000", "642#A402200002000000",
                                   "642#2F00200001000000");
    ask(request, 0);
    CHECK(server.deadline() == kNever);
  }
}

TEST_CASE("SDO sizes: 256 and 65,535 bytes, each way, in segments and in blocks") {
  const auto size = GENERATE(as<std::uint16_t>(), 256, 65535);
  const auto mode = GENERATE(SdoClient::Mode::kSegmented, SdoClient::Mode::kBlock);
  const auto direction = GENERATE(SdoClient::Direction::kRead, SdoClient::Direction::kWrite);
  SdoBytes value(size), memory(size + 1u, 0xEE);  // a guard after it
  for (std::size_t i = 0; i < size; ++i)
    value[i] = static_cast<std::uint8_t>(i * 7 + i / 251 + i / 65);  // all blocks are different
  const bool write = direction == SdoClient::Direction::kWrite;
  if (write) std::copy(value.begin(), value.end(), memory.begin());
  ReferenceServer server({{0x2000, 0, true, true, size, size, 0, ~0u, write ? SdoBytes(size) : value}}, size);
  RecordingPort port;
  SdoClient client(port, std::span(memory).first(size));
  client.start({5, 0, 0x2000, size, direction, mode}, 0);
  for (; !port.sent.empty(); port.sent.pop_front())
    for (const Sdo& response : server.receive(frame_from(port.sent.front()).data))
      client.on_frame({0x585, 8, 0, response}, 0);
  CHECK(client.outcome() == SdoClient::Outcome::kDone);
  CHECK(server.object()->value == value);
  value.push_back(0xEE);
  CHECK(memory == value);
}

TEST_CASE("SDO server: 10,000,000 random frames beside a second implementation", "[.long]") {
  for (unsigned seed = 2; seed < 12; ++seed)
    Beside(seed).run(1'000'000);
}

}  // namespace cbcan::test
