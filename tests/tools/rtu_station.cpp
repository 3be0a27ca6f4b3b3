// SPDX-License-Identifier: MIT
// A coprocessor behind the RTU server of firmware/, on a pseudo-terminal, as a board would have them on a
// UART. Prints "ready DEVICE" and serves until its standard input ends. Its CAN bus takes every frame and has
// no nodes.
//
// usage: rtu_station [STATION]
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "cbcan/coprocessor/coprocessor.hpp"
#include "cbcan/modbus/rtu_server.hpp"

namespace cbcan {
namespace {

Time now() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return static_cast<Time>(std::chrono::duration_cast<std::chrono::microseconds>(since_start).count());
}

struct EmptyBus final : CanPort {
  bool try_send(const Frame& /*frame*/) override { return true; }
};

struct Station {
  Station(int line, std::uint8_t address) : line_(line), server_(networks_, settings(address)) {
    coprocessor_.start(now());
  }

  void serve() {
    while (true) {
      const Time due = turn();
      std::array<pollfd, 2> waiting{pollfd{line_, POLLIN, 0}, pollfd{STDIN_FILENO, POLLIN, 0}};
      poll(waiting.data(), waiting.size(), milliseconds_until(due));
      if (waiting[1].revents != 0) return;
      if (waiting[0].revents != 0) receive();
    }
  }

 private:
  /// The machine under test may be busy; nothing here waits for a gap.
  static RtuServer::Settings settings(std::uint8_t address) {
    RtuServer::Settings settings;
    settings.station = address;
    settings.gap_us = 200'000;
    return settings;
  }

  static int milliseconds_until(Time due) {
    const Time time = now();
    return due <= time ? 0 : static_cast<int>(std::min<Time>((due - time) / kMillisecond + 1, 1000));
  }

  void receive() {
    std::array<std::uint8_t, 256> bytes;
    const ssize_t count = read(line_, bytes.data(), bytes.size());
    for (ssize_t i = 0; i < count; ++i)
      server_.on_byte(bytes[static_cast<std::size_t>(i)], static_cast<std::uint32_t>(now()));
  }

  Time turn() {
    const Time time = now();
    const std::uint32_t silence = server_.poll(static_cast<std::uint32_t>(time));
    if (silence == 0) execute();
    const Time due = coprocessor_.poll(time);
    return silence == 0 || silence == RtuServer::kNoRequest ? due : earlier(due, time + silence);
  }

  void execute() {
    const std::span<const std::uint8_t> response = server_.execute();
    const RtuServer::Executed& executed = server_.executed();
    coprocessor_.on_registers_written(executed.first, executed.count, now());
    coprocessor_.poll(now());
    if (write(line_, response.data(), response.size()) < 0) std::perror("rtu_station");
    server_.on_sent();
  }

  int line_;
  std::array<std::uint16_t, regmap::kRegisterFileWords> registers_{};
  std::array<RegisterRange, 1> ranges_{{{0, registers_}}};
  std::array<RegisterMap, 1> networks_{RegisterMap(ranges_)};
  RtuServer server_;
  EmptyBus bus_;
  Coprocessor coprocessor_{
      RegisterWindow(std::span(registers_).subspan<regmap::kWindowFirst, regmap::kWindowWords>()),
      std::span(registers_).subspan<regmap::kProcessFirst, regmap::kProcessWords>(),
      bus_,
      Coprocessor::Settings{},
      {std::span(registers_).subspan<regmap::kScannerOutFirst, regmap::kScannerOutWords>(),
       std::span(registers_).subspan<regmap::kScannerInFirst, regmap::kScannerInWords>()}};
};

}  // namespace
}  // namespace cbcan

int main(int argc, char** argv) {
  const int address = argc > 1 ? std::atoi(argv[1]) : 1;
  int line = -1;
  int device = -1;  // kept open: else the line would hang up when a client leaves
  std::array<char, 64> name{};
  if (openpty(&line, &device, name.data(), nullptr, nullptr) != 0) {
    std::perror("rtu_station: openpty");
    return EXIT_FAILURE;
  }
  termios raw{};
  tcgetattr(device, &raw);
  cfmakeraw(&raw);
  tcsetattr(device, TCSANOW, &raw);
  cbcan::Station station(line, static_cast<std::uint8_t>(address));
  std::printf("ready %s\n", name.data());
  std::fflush(stdout);
  station.serve();
  return EXIT_SUCCESS;
}
