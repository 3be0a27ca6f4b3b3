// SPDX-License-Identifier: MIT
// A number of Modbus TCP clients in one thread with one epoll, each with one transaction in progress: FC 16
// of R3700..R3709, then FC 3 of R3700 until that is no longer CA0Eh.
#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <memory>
#include <system_error>

#include "bench.hpp"
#include "cbcan/regmap.hpp"
#include "window/request.hpp"

namespace cbcan::bench {

namespace {

using Clock = std::chrono::steady_clock;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kHeaderBytes = 7;  // MBAP
constexpr std::size_t kWriteResponse = kHeaderBytes + 5, kReadResponse = kHeaderBytes + 4;

int checked(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  return result;
}

/// The transaction number is filled in before each sending.
Bytes frame(const window::Request& request) {
  Bytes bytes = window::bytes_of(1, request);
  const auto size = static_cast<std::uint8_t>(bytes.size());
  bytes.insert(bytes.begin(), kHeaderBytes - 1, 0);
  bytes[kHeaderBytes - 2] = size;
  return bytes;
}

class Client {
 public:
  Client(unsigned port, const std::vector<std::uint16_t>& words)
      : write_(frame({.write_address = regmap::kExecuteFlag, .words = words})),
        read_(frame({.read_address = regmap::kExecuteFlag, .count = 1})),
        socket_(checked(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket")) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int on = 1;
    checked(connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), "connect");
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { close(socket_); }

  int socket() const { return socket_; }
  Clock::time_point started() const { return started_; }
  bool polling() const { return polling_; }

  void start(Clock::time_point now) {
    started_ = now;
    send(write_, false);
  }
  void poll() { send(read_, true); }

  /// Receives the response to the last request, which arrives in one piece over loopback; returns R3700, if that
  /// was requested.
  std::uint16_t receive() {
    std::array<std::uint8_t, 64> response;
    const ssize_t size = recv(socket_, response.data(), response.size(), 0);
    const Bytes& request = polling_ ? read_ : write_;
    require(size == static_cast<ssize_t>(polling_ ? kReadResponse : kWriteResponse) &&
                std::equal(&request[0], &request[5], response.begin()) &&
                response[kHeaderBytes] == request[kHeaderBytes],
            "a response does not belong to its request");
    return static_cast<std::uint16_t>(response[kReadResponse - 2] << 8 | response[kReadResponse - 1]);
  }

 private:
  void send(Bytes& request, bool polling) {
    polling_ = polling;
    ++number_;
    request[0] = static_cast<std::uint8_t>(number_ >> 8);
    request[1] = static_cast<std::uint8_t>(number_);
    checked(static_cast<int>(::send(socket_, request.data(), request.size(), MSG_NOSIGNAL)), "send");
  }

  Bytes write_, read_;
  int socket_;
  bool polling_ = false;
  std::uint16_t number_ = 0;
  Clock::time_point started_{};
};

class Load {
 public:
  explicit Load(unsigned transactions)
      : transactions_(transactions), epoll_(checked(epoll_create1(EPOLL_CLOEXEC), "epoll")) {
    latencies_.reserve(transactions);
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;
  ~Load() { close(epoll_); }

  void add(std::unique_ptr<Client> client) {
    epoll_event event{.events = EPOLLIN, .data = {.ptr = client.get()}};
    checked(epoll_ctl(epoll_, EPOLL_CTL_ADD, client->socket(), &event), "epoll");
    clients_.push_back(std::move(client));
  }

  void execute() {
    for (auto& client : clients_)
      start_next(*client, Clock::now());
    std::array<epoll_event, 64> events;
    while (latencies_.size() < transactions_) {
      const int count = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), -1);
      for (int i = 0; i < count; ++i)
        on_ready(*static_cast<Client*>(events[static_cast<std::size_t>(i)].data.ptr));
    }
  }

  void print() {
    const std::chrono::duration<double> took = Clock::now() - began_;
    std::printf("%.0f transactions a second, median %.1f us, 99 %% within %.1f us; %u polls\n",
                transactions_ / took.count(), percentile(50), percentile(99), polls_);
  }

 private:
  void start_next(Client& client, Clock::time_point now) {
    if (started_ == transactions_) return;
    ++started_;
    client.start(now);
  }

  void on_ready(Client& client) {
    const bool polled = client.polling();
    const std::uint16_t flag = client.receive();
    if (!polled || flag == regmap::kExecute) {
      ++polls_;
      return client.poll();
    }
    require(flag == static_cast<std::uint16_t>(regmap::Result::kOk), "a transaction has failed");
    const auto now = Clock::now();
    latencies_.push_back(now - client.started());
    start_next(client, now);
  }

  double percentile(std::size_t percent) {
    const auto place = latencies_.begin() + static_cast<std::ptrdiff_t>(latencies_.size() * percent / 100);
    std::nth_element(latencies_.begin(), place, latencies_.end());
    return std::chrono::duration<double, std::micro>(*place).count();
  }

  unsigned transactions_;
  int epoll_;
  std::vector<std::unique_ptr<Client>> clients_;
  std::vector<Clock::duration> latencies_;
  unsigned started_ = 0, polls_ = 0;
  Clock::time_point began_ = Clock::now();
};

}  // namespace

void load(const Arguments& arguments) {
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>(arguments.number(at, 0, 0, 0xFFFF));
  };
  const std::vector<std::uint16_t> words{regmap::kExecute, regmap::kSdoRead, word(3), word(4), 0, word(5), 0, 0, 0, 0};
  Load load(arguments.number(2, 0, 1));
  for (unsigned i = 0; i < arguments.number(1, 0, 1, 0xFFFF); ++i)
    load.add(std::make_unique<Client>(word(0), words));
  load.execute();
  load.print();
}

}  // namespace cbcan::bench
