// SPDX-License-Identifier: MIT
// The SDO client beside a second one, by random responses: what goes on with the transfer, nearly that, and
// anything. Each frame that it sends is the same, byte for byte, and so are the outcome and the bytes read.

#include "cbcan/canopen/sdo/client.hpp"
#include "core/sdo_reference.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

namespace {

using State = ReferenceClient::State;
using Mode = ReferenceClient::Mode;

constexpr std::size_t kRoom = 600;

/// What a server could say next. A value that is read has total_ bytes.
struct Server : RandomSdo {
  using RandomSdo::RandomSdo;

  struct Response {
    Sdo bytes;
    std::size_t length;
  };
  Response next(const ReferenceClient& client) {
    Response response{one_of(50) == 0 ? anything() : plausible(client), 8};
    if (one_of(40) == 0) response.bytes[one_of(8)] = byte();
    if (one_of(80) == 0) response.bytes[0] = static_cast<std::uint8_t>(response.bytes[0] ^ 1 << one_of(8));
    if (one_of(30) == 0) response.length = one_of(9);
    std::fill(response.bytes.begin() + static_cast<std::ptrdiff_t>(response.length), response.bytes.end(),
              std::uint8_t{0});
    return response;
  }
  ReferenceClient::Request request() {
    ReferenceClient::Request request{one_of(2) == 0, static_cast<Mode>(one_of(4)), 0, 0, {}, 0};
    request.index = one_of(10) == 0 ? 0 : 0x2000 + static_cast<unsigned>(one_of(3));
    request.sub = static_cast<unsigned>(one_of(2));
    const std::size_t kind = one_of(4);
    request.room = 1 + one_of(kind == 0 ? 4 : kind == 1 ? 30 : kRoom);
    for (std::size_t i = 0; i < request.room && request.write; ++i)
      request.value.push_back(byte());
    return request;
  }

 private:
  Sdo about(const ReferenceClient& client, unsigned command) {
    Sdo frame = with(command);
    frame[1] = static_cast<std::uint8_t>(client.request().index);
    frame[2] = static_cast<std::uint8_t>(client.request().index >> 8);
    frame[3] = static_cast<std::uint8_t>(client.request().sub);
    return frame;
  }

  Sdo plausible(const ReferenceClient& client) {
    if (one_of(200) == 0) return about(client, 0x80);
    if (one_of(500) == 0) return {0x80};  // of no object, and without a code
    switch (client.state()) {
      case State::kUpload: return initiate_upload(client);
      case State::kUploadSegments: return segment(client);
      case State::kDownloadExpedited:
      case State::kDownload: return about(client, 0x60);
      case State::kDownloadSegments: return with(0x20 + 16 * client.toggle());
      case State::kBlockDownload: return initiate_block_download(client);
      case State::kBlockSegments: return taken(client);
      case State::kBlockDownloadEnd: return with(0xA1);
      case State::kBlockUpload: return sized(about(client, 0xC0 + 2 * bit() + 4 * bit()), 2, client);
      case State::kBlockUploadSegments: return block_segment(client);
      case State::kBlockUploadEnd: return block_end(client);
      default: return anything();
    }
  }
  unsigned bit() { return static_cast<unsigned>(one_of(2)); }
  /// The value gets a size, which is told where `flag` says so.
  Sdo sized(Sdo frame, unsigned flag, const ReferenceClient& client) {
    const std::size_t room = client.request().room;
    total_ = one_of(8) == 0 ? one_of(kRoom + 10) : one_of(room + 1);
    if ((frame[0] & flag) == 0) return frame;
    const std::size_t told = one_of(20) == 0 ? one_of(kRoom) : total_;
    frame[4] = static_cast<std::uint8_t>(told);
    frame[5] = static_cast<std::uint8_t>(told >> 8);
    frame[6] = frame[7] = 0;
    return frame;
  }
  Sdo initiate_upload(const ReferenceClient& client) {
    if (client.request().room <= 4 && one_of(3) != 0)
      return about(client, 0x42 + bit() + 4 * static_cast<unsigned>(one_of(4)));
    return sized(about(client, 0x40 + bit()), 1, client);
  }
  Sdo segment(const ReferenceClient& client) {
    const bool empty = endless_ || one_of(200) == 0;
    if (empty && one_of(4) == 0) endless_ = true;
    const std::size_t size = empty ? 0 : one_of(10) == 0 ? one_of(8) : std::min<std::size_t>(7, left(client));
    const bool last = !empty && size >= left(client);
    if (last) endless_ = false;
    return with(16 * client.toggle() + 2 * (7 - static_cast<unsigned>(size)) + last);
  }
  Sdo initiate_block_download(const ReferenceClient& client) {
    Sdo frame = about(client, 0xA0 + 4 * bit());
    frame[4] = static_cast<std::uint8_t>(one_of(20) == 0 ? one_of(256) : 1 + one_of(127));
    return frame;
  }
  Sdo taken(const ReferenceClient& client) {
    Sdo frame = with(0xA2);
    const std::size_t kind = one_of(10), sent = client.sequence();
    stubborn_ = stubborn_ ? one_of(20) != 0 : one_of(40) == 0;
    frame[1] = static_cast<std::uint8_t>(stubborn_ ? 0 : kind == 0 ? one_of(sent + 2) : sent);
    frame[2] = static_cast<std::uint8_t>(one_of(40) == 0 ? one_of(256) : 1 + one_of(127));
    return frame;
  }
  /// Now and then one is lost, or comes again.
  Sdo block_segment(const ReferenceClient& client) {
    const std::size_t kind = one_of(60);
    repeats_ = repeats_ ? one_of(200) != 0 : one_of(1'000) == 0;
    if (repeats_) return with(1 + client.sequence() % 2);
    stubborn_ = stubborn_ ? one_of(30) != 0 : one_of(150) == 0;
    const unsigned number = client.sequence() + (kind == 0 || stubborn_ ? 2 : kind == 1 ? 0 : 1);
    const bool next = number == client.sequence() + 1;
    const bool last = next ? left(client) <= 7 : bit() != 0;
    return with(number % 128 + (last ? 128 : 0));
  }
  Sdo block_end(const ReferenceClient& client) {
    if (one_of(8) == 0) return with(1 + static_cast<unsigned>(one_of(client.block_size())));
    SdoBytes value = client.value();
    const std::size_t unused = one_of(20) == 0 ? one_of(8) : (value.size() - total_) % 8;
    value.resize(value.size() - unused);
    const unsigned crc = reference_crc(value);
    Sdo frame = with(0xC1 + 4 * static_cast<unsigned>(unused));
    if (one_of(10) == 0) return frame;
    frame[1] = static_cast<std::uint8_t>(crc);
    frame[2] = static_cast<std::uint8_t>(crc >> 8);
    return frame;
  }

  std::size_t left(const ReferenceClient& client) const {
    return total_ - std::min(total_, client.value().size());
  }

  std::size_t total_ = 0;
  bool endless_ = false;   ///< segments without data
  bool repeats_ = false;   ///< the first two segments of a sub-block, for ever
  bool stubborn_ = false;  ///< sub-blocks that bring nothing new
};

std::string text(const Sdo& bytes, std::size_t length = 8) {
  Frame frame{0x605, static_cast<std::uint8_t>(length), 0, bytes};
  return text_of(frame);
}

struct Beside {
  explicit Beside(unsigned seed) : server(seed) {}

  /// So many responses, and as many transfers as they make.
  void run(std::size_t responses) {
    while (responses > 0) {
      const ReferenceClient::Request request = server.request();
      ReferenceClient reference(request);
      start(request);
      compare(reference);
      for (; responses > 0 && !reference.over(); --responses) {
        const Server::Response response = server.next(reference);
        asked.push_back(text(response.bytes, response.length));
        client.on_frame({0x585, static_cast<std::uint8_t>(response.length), 0, response.bytes}, now);
        reference.receive(response.bytes, response.length);
        compare(reference);
      }
      client.cancel(now);
      now += 10 * kSecond;  // no quarantine
      client.poll(now);
      port.sent.clear();
    }
  }

 private:
  void start(const ReferenceClient::Request& request) {
    using Direction = SdoClient::Direction;
    const auto size = static_cast<std::uint16_t>(request.room);
    std::copy(request.value.begin(), request.value.end(), data.begin());
    asked.assign({std::string(request.write ? "write " : "read ") + std::to_string(size) + " in mode " +
                  std::to_string(static_cast<int>(request.mode))});
    client.forget_nodes();
    client.start(
        {5, static_cast<std::uint8_t>(request.sub), static_cast<std::uint16_t>(request.index), size,
         request.write ? Direction::kWrite : Direction::kRead, static_cast<SdoClient::Mode>(request.mode)},
        now);
  }

  void compare(ReferenceClient& reference) {
    std::deque<std::string> expected;
    for (const Sdo& frame : reference.sent())
      expected.push_back(text(frame));
    const std::deque<std::string> sent = std::exchange(port.sent, {});
    if (sent != expected) differ(expected, sent);
    if (client.busy() == reference.over()) differ({"busy"}, {});
    if (!reference.over()) return;
    const bool done = client.outcome() == SdoClient::Outcome::kDone;
    const std::uint32_t error = done ? 0 : static_cast<std::uint32_t>(client.error());
    if (error != reference.error()) differ({std::to_string(reference.error())}, {std::to_string(error)});
    ++seen[error];
    if (error != 0 || reference.request().write) return;
    const SdoBytes read(data.begin(), data.begin() + client.size());
    if (read != reference.value()) differ({"value"}, {});
  }
  void differ(const std::deque<std::string>& expected, const std::deque<std::string>& sent) {
    for (const std::string& line : asked)
      UNSCOPED_INFO(line);
    for (const std::string& line : expected)
      UNSCOPED_INFO("expected " << line);
    for (const std::string& line : sent)
      UNSCOPED_INFO("was      " << line);
    FAIL("not the same");
  }

 public:
  std::vector<std::uint8_t> data = std::vector<std::uint8_t>(kRoom + 10);
  RecordingPort port;
  SdoClient client{port, data};
  Server server;
  Time now = 0;
  std::deque<std::string> asked;
  std::map<std::uint32_t, std::size_t> seen;  ///< outcomes; 0 = done
};

}  // namespace

TEST_CASE("SDO client: 100,000 random responses, each request and outcome that of a second implementation") {
  Beside beside(1);
  beside.run(100'000);
  for (const std::uint32_t code : {0x05030000u, 0x05040001u, 0x05040002u, 0x05040003u, 0x05040004u,
                                   0x05040005u, 0x06010000u, 0x06070010u, 0x08000000u}) {
    INFO(std::hex << code);
    CHECK(beside.seen[code] >= 10);
  }
  CHECK(beside.seen[0] > 1'000);
}

TEST_CASE("SDO client: 10,000,000 random responses beside a second implementation", "[.long]") {
  for (unsigned seed = 2; seed < 12; ++seed)
    Beside(seed).run(1'000'000);
}

}  // namespace cbcan::test
