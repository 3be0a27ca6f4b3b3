// SPDX-License-Identifier: MIT
// A number of Modbus TCP clients in one thread with one epoll, each with one transaction under way: FC 16 of
// R3700..R3709, then FC 3 of R3700 until that is no longer CA0Eh. Prints what it measured as one line of
// JSON. Exit code 0 = every response was the right one.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "cbcan/regmap.hpp"

namespace {

using Clock = std::chrono::steady_clock;
namespace regmap = cbcan::regmap;

constexpr const char* kUsage =
    "usage: load_client PORT CLIENTS TRANSACTIONS FLAG NODE INDEX SIZE [NETWORKS]\n"
    "  TRANSACTIONS   of all clients together\n"
    "  FLAG           what is written to R3700: 0xCA0E, or 0 for a server that executes nothing\n"
    "  NODE INDEX SIZE   what is read: sub-index 0 of that object\n"
    "  NETWORKS       unit IDs from 1 on that the clients divide among themselves (default: 1)\n";

constexpr std::size_t kHeaderBytes = 7;  // MBAP
constexpr std::uint8_t kWrite = 16;
constexpr std::uint8_t kRead = 3;
constexpr std::uint16_t kWords = 10;

struct Load {
  std::uint16_t port, clients;
  std::uint64_t transactions;
  std::uint16_t flag, node, index, size;
  std::uint16_t networks;
};

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

/// One request's bytes; the transaction ID is filled in before each sending.
class Request {
 public:
  Request(std::uint8_t function, std::initializer_list<std::uint16_t> words)
      : bytes_{0, 0, 0, 0, 0, 0, 1, function} {
    for (const std::uint16_t word : words)
      append(word);
  }

  Request& byte(std::uint8_t value) {
    bytes_.push_back(value);
    return *this;
  }
  Request& append(std::uint16_t word) {
    bytes_.push_back(static_cast<std::uint8_t>(word >> 8));
    bytes_.push_back(static_cast<std::uint8_t>(word));
    return *this;
  }

  void send(int socket, std::uint16_t number, std::uint8_t unit) {
    bytes_[0] = static_cast<std::uint8_t>(number >> 8);
    bytes_[1] = static_cast<std::uint8_t>(number);
    bytes_[5] = static_cast<std::uint8_t>(bytes_.size() - kHeaderBytes + 1);
    bytes_[6] = unit;
    if (::send(socket, bytes_.data(), bytes_.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(bytes_.size()))
      fail("send");
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

Request write_request(const Load& load) {
  Request request(kWrite, {regmap::kExecuteFlag, kWords});
  request.byte(2 * kWords);
  for (const std::uint16_t word :
       {load.flag, regmap::kSdoRead, load.node, load.index, std::uint16_t{0}, load.size})
    request.append(word);
  for (int i = 6; i < kWords; ++i)
    request.append(0);
  return request;
}

class Client {
 public:
  Client(std::uint16_t port, std::uint8_t unit)
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)), unit_(unit) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int on = 1;
    if (socket_ < 0 || connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
      fail("connect");
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { close(socket_); }

  int socket() const { return socket_; }
  Clock::time_point started() const { return started_; }
  bool polling() const { return function_ == kRead; }

  void start(Request& write, Clock::time_point now) {
    started_ = now;
    send(write, kWrite);
  }
  void poll(Request& read) { send(read, kRead); }

  /// True when a whole response is there.
  bool receive() {
    const ssize_t count = recv(socket_, response_.data() + received_, response_.size() - received_, 0);
    if (count <= 0) throw std::runtime_error("the server closed the connection");
    received_ += static_cast<std::size_t>(count);
    return received_ >= kHeaderBytes + 1 && received_ >= response_bytes();
  }

  /// R3700 as the poll's response tells it; checks that it is the response to this client's last request.
  std::uint16_t check_response() {
    if (received_ != response_bytes() || word(0) != number_ || response_[kHeaderBytes] != function_)
      throw std::runtime_error("a response that does not belong to the request");
    received_ = 0;
    return word(kHeaderBytes + 2);
  }

 private:
  void send(Request& request, std::uint8_t function) {
    function_ = function;
    request.send(socket_, ++number_, unit_);
  }
  std::uint16_t word(std::size_t offset) const {
    return static_cast<std::uint16_t>(response_[offset] << 8 | response_[offset + 1]);
  }
  /// FC 16: address and quantity. FC 3: byte count and one word. An exception, which check_response()
  /// refuses: its code.
  std::size_t response_bytes() const {
    if (response_[kHeaderBytes] != function_) return kHeaderBytes + 2;
    return kHeaderBytes + (function_ == kWrite ? 5u : 4u);
  }

  int socket_;
  std::uint8_t unit_;
  std::uint16_t number_ = 0;
  std::uint8_t function_ = 0;
  Clock::time_point started_{};
  std::size_t received_ = 0;
  std::array<std::uint8_t, 64> response_{};
};

class Run {
 public:
  explicit Run(const Load& load)
      : load_(load), write_(write_request(load)), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
    if (epoll_ < 0) fail("epoll");
    latencies_.reserve(load.transactions);
    for (std::uint16_t i = 0; i < load.clients; ++i)
      add_client(static_cast<std::uint8_t>(1 + i % load.networks));
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  ~Run() { close(epoll_); }

  void execute() {
    begun_ = Clock::now();
    for (auto& client : clients_)
      start_next(*client, begun_);
    std::array<epoll_event, 64> events;
    while (latencies_.size() < load_.transactions) {
      const int count = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), -1);
      for (int i = 0; i < count; ++i)
        on_ready(*static_cast<Client*>(events[static_cast<std::size_t>(i)].data.ptr));
    }
    ended_ = Clock::now();
  }

  void print() {
    const double seconds = std::chrono::duration<double>(ended_ - begun_).count();
    std::printf(
        "{\"per_second\": %.1f, \"p50_us\": %.1f, \"p99_us\": %.1f, \"polls\": %llu, \"not_ok\": %llu}\n",
        static_cast<double>(load_.transactions) / seconds, percentile(50), percentile(99),
        static_cast<unsigned long long>(polls_), static_cast<unsigned long long>(not_ok_));
  }

  bool all_ok() const { return not_ok_ == 0; }

 private:
  void add_client(std::uint8_t unit) {
    clients_.push_back(std::make_unique<Client>(load_.port, unit));
    epoll_event event{.events = EPOLLIN, .data = {.ptr = clients_.back().get()}};
    if (epoll_ctl(epoll_, EPOLL_CTL_ADD, clients_.back()->socket(), &event) != 0) fail("epoll");
  }

  void start_next(Client& client, Clock::time_point now) {
    if (started_ == load_.transactions) return;
    ++started_;
    client.start(write_, now);
  }

  void on_ready(Client& client) {
    if (!client.receive()) return;
    const bool polled = client.polling();
    const std::uint16_t flag = client.check_response();
    if (!polled || flag == regmap::kExecute) {
      ++polls_;
      return client.poll(read_);
    }
    if (flag != static_cast<std::uint16_t>(regmap::Result::kOk)) ++not_ok_;
    const auto now = Clock::now();
    latencies_.push_back(now - client.started());
    start_next(client, now);
  }

  double percentile(std::size_t percent) {
    const auto place = latencies_.begin() + static_cast<std::ptrdiff_t>(latencies_.size() * percent / 100);
    std::nth_element(latencies_.begin(), place, latencies_.end());
    return std::chrono::duration<double, std::micro>(*place).count();
  }

  Load load_;
  Request write_;
  Request read_{kRead, {regmap::kExecuteFlag, 1}};
  int epoll_;
  std::vector<std::unique_ptr<Client>> clients_;
  std::vector<Clock::duration> latencies_;
  std::uint64_t started_ = 0, polls_ = 0, not_ok_ = 0;
  Clock::time_point begun_{}, ended_{};
};

unsigned long number(const char* text, unsigned long least, unsigned long most) {
  const unsigned long value = std::stoul(text, nullptr, 0);
  if (value < least || value > most) throw std::out_of_range(text);
  return value;
}

Load parse(int argc, char** argv) {
  constexpr unsigned long kWord = 0xFFFF;
  constexpr unsigned long kUnits = 247;
  const auto word = [&](int i, unsigned long least) {
    return static_cast<std::uint16_t>(number(argv[i], least, kWord));
  };
  return {word(1, 1),
          word(2, 1),
          number(argv[3], 1, 100'000'000),
          word(4, 0),
          word(5, 0),
          word(6, 0),
          word(7, 0),
          static_cast<std::uint16_t>(argc == 9 ? number(argv[8], 1, kUnits) : 1)};
}

}  // namespace

int main(int argc, char** argv) {
  Load load{};
  try {
    if (argc != 8 && argc != 9) throw std::invalid_argument("arguments");
    load = parse(argc, argv);
  } catch (const std::logic_error&) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  try {
    Run run(load);
    run.execute();
    run.print();
    return run.all_ok() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "load_client: 127.0.0.1:%u: %s\n", load.port, error.what());
    return 3;
  }
}
