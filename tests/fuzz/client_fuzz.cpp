// SPDX-License-Identifier: MIT
// Any bytes, in any pieces, from a Modbus server to a client: what it accepts as the response to its request
// is one, byte for byte, and anything else ends the connection.
//
// The input: three bytes of the request (function, words to write, words to read), then a list of pieces,
// each after two bytes: flags and length.
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "fuzz/fuzz.hpp"
#include "io/sockets/listener.hpp"
#include "window/connection.hpp"

namespace cbcan::fuzz {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kUnit = 7;
constexpr std::uint8_t kIsPdu = 1;   ///< the piece is sent as a response with a good header
constexpr std::uint8_t kIsGood = 2;  ///< the response of a correct server is sent, with the piece as data
constexpr std::uint8_t kGather = 4;  ///< the client receives it together with the next
constexpr window::Time kTimeout = 1'000;

/// Exists as long as the program.
const io::StreamListener& listener() {
  static const io::StreamListener the_listener("modbus", {"", {"127.0.0.1", 0}});
  return the_listener;
}

/// Closed with a reset, so that no port stays in use.
io::Descriptor accept() {
  io::Descriptor accepted(::accept4(listener().socket(), nullptr, nullptr, SOCK_CLOEXEC));
  const linger at_once{1, 0};
  setsockopt(accepted.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  return accepted;
}

Bytes framed(const Bytes& unit_and_pdu) {
  const std::size_t size = unit_and_pdu.size();
  Bytes bytes{0, 0, 0, 0, static_cast<std::uint8_t>(size >> 8), static_cast<std::uint8_t>(size)};
  bytes.insert(bytes.end(), unit_and_pdu.begin(), unit_and_pdu.end());
  return bytes;
}

/// A request and the responses to it, after V1.1b3, 6.3, 6.12, 6.17 and 7.
struct Model {
  window::Request request;

  Model(std::uint8_t kind, std::uint8_t writes, std::uint8_t reads) {
    request.write_address = 0x0E74;
    request.read_address = 0x0E75;
    if (kind % 3 != 1) request.count = static_cast<std::uint16_t>(1 + reads % 125);
    for (unsigned i = 0; kind % 3 != 0 && i <= writes % 121u; ++i)
      request.words.push_back(static_cast<std::uint16_t>(257 * i));
  }
  std::uint8_t function() const { return request.words.empty() ? 3 : request.count == 0 ? 16 : 23; }

  Bytes asked() const {
    Bytes bytes{kUnit, function()};
    const auto put = [&bytes](std::size_t word) {
      bytes.push_back(static_cast<std::uint8_t>(word >> 8));
      bytes.push_back(static_cast<std::uint8_t>(word));
    };
    if (request.count != 0) put(request.read_address), put(request.count);
    if (request.words.empty()) return framed(bytes);
    put(request.write_address);
    put(request.words.size());
    bytes.push_back(static_cast<std::uint8_t>(2 * request.words.size()));
    for (const std::uint16_t word : request.words)
      put(word);
    return framed(bytes);
  }
  Bytes good(const Bytes& data) const {
    Bytes bytes{kUnit, function()};
    if (function() == 16) {
      bytes.insert(bytes.end(), {0x0E, 0x74, 0, static_cast<std::uint8_t>(request.words.size())});
    } else {
      bytes.push_back(static_cast<std::uint8_t>(2 * request.count));
      for (std::size_t i = 0; i < 2u * request.count; ++i)
        bytes.push_back(i < data.size() ? data[i] : 0);
    }
    return framed(bytes);
  }

  enum class Verdict { kComes, kResponse, kNone };
  /// The expected verdict on all received bytes. The address in a response to FC 16 is not checked.
  Verdict verdict(const Bytes& come, window::Response& response) const {
    if (come.size() < 6) return Verdict::kComes;
    const std::size_t length = come[4] * 256u + come[5];
    const std::size_t pdu = come.size() - 7;
    const bool whole = come.size() == 6 + length && length >= 2;
    const bool head = whole && std::count(come.begin(), come.begin() + 4, 0) == 4 && come[6] == kUnit;
    if (head && pdu == 2 && come[7] == function() + 128 && come[8] != 0) {
      response = {come[8], {}};
      return Verdict::kResponse;
    }
    if (head && come[7] == function() && pdu == (function() == 16 ? 5u : 2u + 2u * request.count) &&
        (function() == 16 || come[8] == 2 * request.count)) {
      response = {0, {}};
      for (std::size_t i = 0; i < request.count; ++i)
        response.words.push_back(static_cast<std::uint16_t>(come[9 + 2 * i] * 256u + come[10 + 2 * i]));
      return Verdict::kResponse;
    }
    return 6 + length <= 260 && come.size() < 6 + length ? Verdict::kComes : Verdict::kNone;
  }
};

struct Run {
  explicit Run(const std::array<std::uint8_t, 3>& request) : model_(request[0], request[1], request[2]) {
    while (client_->state() != window::Connection::State::kOn)
      client_->poll(0);
    server_ = accept();
    ask();
  }

  void piece(std::uint8_t flags, const Bytes& bytes) {
    Bytes sent = bytes;
    if ((flags & kIsPdu) != 0) sent = framed(bytes);
    if ((flags & kIsGood) != 0) sent = model_.good(bytes);
    if (!sent.empty()) ::send(server_.get(), sent.data(), sent.size(), MSG_NOSIGNAL);
    come_.insert(come_.end(), sent.begin(), sent.end());
    if ((flags & kGather) == 0) check_client();
  }
  bool over() const { return over_; }

  /// Silence ends an incomplete response.
  void end() {
    if (!over_) check_client();
    if (over_) return;
    require(!client_->receive(kTimeout).has_value(), "no response comes of silence");
    require(client_->state() == window::Connection::State::kOff, "silence ends the connection");
  }

 private:
  void ask() {
    require(client_->ready(0), "a request can be sent");
    client_->send(kUnit, model_.request, 0);
    const Bytes expected = model_.asked();
    Bytes bytes(expected.size());
    ::recv(server_.get(), bytes.data(), bytes.size(), MSG_WAITALL);
    require(bytes == expected, "the request is that of the specification");
    come_.clear();
    taken_ = 0;
  }

  /// Loopback may take a moment.
  void wait_until_all_has_come() const {
    int count = 0;
    while (ioctl(client_->descriptor(), FIONREAD, &count) == 0 &&
           static_cast<std::size_t>(count) < come_.size() - taken_) {
    }
  }

  void check_client() {
    wait_until_all_has_come();
    window::Response expected;
    const Model::Verdict verdict = model_.verdict(come_, expected);
    const std::optional<window::Response> response = client_->receive(0);
    taken_ = come_.size();
    require(response.has_value() == (verdict == Model::Verdict::kResponse),
            "a response is taken, and no other");
    const bool on = client_->state() == window::Connection::State::kOn;
    require(on == (verdict != Model::Verdict::kNone), "what is no response ends the connection");
    over_ = !on;
    if (!response) return;
    require(response->exception == expected.exception && response->words == expected.words,
            "the words are those that came");
    ask();
  }

  Model model_;
  std::unique_ptr<window::Connection> client_ =
      window::tcp_connection("127.0.0.1", listener().address().tcp.port, {kTimeout, 1, 1});
  io::Descriptor server_;
  Bytes come_;
  std::size_t taken_ = 0;  ///< of them, taken by the client
  bool over_ = false;
};

}  // namespace

void run(Input input) {
  const std::uint8_t kind = input.byte(), writes = input.byte(), reads = input.byte();
  Run run({kind, writes, reads});
  for (unsigned pieces = 0; !input.empty() && !run.over() && pieces < 50; ++pieces) {
    const std::uint8_t flags = input.byte();
    const auto bytes = input.take(input.byte());
    run.piece(flags, {bytes.begin(), bytes.end()});
  }
  run.end();
}

}  // namespace cbcan::fuzz
