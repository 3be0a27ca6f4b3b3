// SPDX-License-Identifier: MIT
// A PLC that owns its registers, as one would write it with libmodbus alone, and cbcan-sim as its module: how
// long a transaction takes, and what looking at the PLC costs.
//
// usage: cbcan-bench-plc CBCAN_SIM TRANSACTIONS IDLE_POLLS
#include <fcntl.h>
#include <modbus.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint16_t kExecute = 0xCA0E;
constexpr int kWords = 138;
constexpr int kIn = 70;

double microseconds(Clock::duration time) {
  return std::chrono::duration<double, std::micro>(time).count();
}

/// The PLC, and cbcan-sim as a child that connects to it.
class Plc {
 public:
  Plc(const char* program, const std::string& options)
      : context_(modbus_new_tcp("127.0.0.1", 0)), mapping_(modbus_mapping_new(0, 0, kWords, 0)) {
    const int listener = modbus_tcp_listen(context_, 1);
    sockaddr_in address{};
    socklen_t size = sizeof address;
    getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
    const std::string plc = "127.0.0.1:" + std::to_string(ntohs(address.sin_port)) + ",first=0," + options;
    child_ = fork();
    if (child_ == 0) {
      dup2(::open("/dev/null", O_WRONLY), STDOUT_FILENO);
      execl(program, program, "--demo", "--modbus", "127.0.0.1:0", "--plc", plc.c_str(), nullptr);
      _exit(127);
    }
    int socket = listener;
    if (modbus_tcp_accept(context_, &socket) < 0) throw std::runtime_error("nobody connects");
  }
  Plc(const Plc&) = delete;
  Plc& operator=(const Plc&) = delete;
  ~Plc() {
    if (child_ > 0) stop();
    modbus_close(context_);
    modbus_mapping_free(mapping_);
    modbus_free(context_);
  }

  std::uint16_t& word(int at) { return mapping_->tab_registers[at]; }

  void serve() {
    const int size = modbus_receive(context_, request_);
    if (size < 0) throw std::runtime_error("cbcan-sim has left");
    modbus_reply(context_, request_, size, mapping_);
  }

  /// Its processor time, in microseconds.
  double stop() {
    rusage used{};
    kill(child_, SIGTERM);
    wait4(child_, nullptr, 0, &used);
    child_ = 0;
    const auto of = [](const timeval& time) {
      return 1e6 * static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec);
    };
    return of(used.ru_utime) + of(used.ru_stime);
  }

 private:
  modbus_t* context_;
  modbus_mapping_t* mapping_;
  pid_t child_ = 0;
  std::uint8_t request_[MODBUS_TCP_MAX_ADU_LENGTH]{};
};

/// Written by the program behind a poll: the worst moment. In microseconds.
double transaction(Plc& plc, bool scanner, std::uint16_t number) {
  const std::uint16_t request[] = {5055, 0x20, 0x2004, 0, 4};
  std::copy(std::begin(request), std::end(request), &plc.word(1));
  const auto begin = Clock::now();
  plc.word(0) = scanner ? number : kExecute;
  while (scanner ? plc.word(kIn) != number : plc.word(0) == kExecute)
    plc.serve();
  const double time = microseconds(Clock::now() - begin);
  const bool first = scanner && number == 1;  // answered by 5, not executed
  if (!first && (scanner ? plc.word(kIn + 1) : plc.word(0)) != 0)
    throw std::runtime_error("a transaction has failed");
  plc.serve();
  return time;
}

void latency(const char* program, int transactions, int period_ms, bool scanner) {
  Plc plc(program, "period_ms=" + std::to_string(period_ms) + (scanner ? ",layout=scanner" : ""));
  for (int i = 0; i < 3; ++i)
    plc.serve();
  std::vector<double> times;
  for (int i = 0; i < transactions; ++i)
    times.push_back(transaction(plc, scanner, static_cast<std::uint16_t>(i % 65535 + 1)));
  std::ranges::sort(times);
  std::printf("%s every %d ms: p50 %.0f us, p99 %.0f us\n", scanner ? "scanner" : "window", period_ms,
              times[times.size() / 2], times[times.size() * 99 / 100]);
}

void poll_cost(const char* program, int polls, bool scanner) {
  const auto cost = [&](int count) {
    Plc plc(program, std::string("period_ms=1") + (scanner ? ",layout=scanner" : ""));
    for (int i = 0; i < count; ++i)
      plc.serve();
    return plc.stop();
  };
  const double nothing = cost(3);
  std::printf("%s, idle: %.1f us of processor time a poll\n", scanner ? "scanner" : "window",
              (cost(polls) - nothing) / polls);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return std::fprintf(stderr, "usage: %s CBCAN_SIM TRANSACTIONS IDLE_POLLS\n", argv[0]), 2;
  try {
    for (const bool scanner : {false, true}) {
      for (const int period_ms : {1, 10})
        latency(argv[1], std::atoi(argv[2]), period_ms, scanner);
      poll_cost(argv[1], std::atoi(argv[3]), scanner);
    }
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 1;
  }
  return 0;
}
