// SPDX-License-Identifier: MIT
// Starts pressure transducer 1 of `cbcan-sim --demo`, reads its name and three pressures, and ends.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>

#include "cbcan/cia405.hpp"

namespace cia405 = cbcan::cia405;

namespace {

constexpr std::uint8_t kTransducer = 1;

bool ended(const cia405::FunctionBlock& block) {
  return block.confirm || block.error != cia405::KernelError::kNone;
}

/// The program; a PLC's variables are members here.
class Program {
 public:
  explicit Program(int port) : link_({.port = port}) {
    start_.device = name_.device = pressure_.device = kTransducer;
    start_.state = cia405::TransitionState::kStartRemoteNode;
    start_.timeout = name_.timeout = pressure_.timeout = 1000;
    name_.index = 0x1008;
    name_.data = text_;
    pressure_.index = 0x9130;
    pressure_.subindex = 1;
  }

  /// One cycle; false at the end.
  bool cycle(cia405::Time now) {
    link_.poll(now);
    if (failed(start_) || failed(name_) || failed(pressure_)) return false;
    start_.enable = true;
    start_.call(now);
    name_.enable = start_.confirm;
    name_.call(now);
    pressure_.enable = name_.confirm && !ended(pressure_);  // repeatedly
    pressure_.call(now);
    if (pressure_.confirm) show();
    return shown_ < 3;
  }

 private:
  bool failed(const cia405::FunctionBlock& block) const {
    if (block.error == cia405::KernelError::kNone) return false;
    std::cerr << "error " << static_cast<int>(block.error) << " " << link_.problem() << "\n";
    return true;
  }

  void show() {
    std::uint32_t pascals = 0;
    for (std::size_t i = pressure_.data.size(); i-- > 0;)
      pascals = pascals << 8 | pressure_.data[i];
    std::cout << std::string(text_.begin(), text_.begin() + name_.datalength) << ": " << pascals << " Pa\n";
    ++shown_;
  }

  cia405::Link link_;
  cia405::Nmt start_{link_};
  cia405::SdoRead name_{link_};
  cia405::SdoRead4 pressure_{link_};
  std::array<std::uint8_t, 32> text_{};
  int shown_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  using std::chrono::microseconds, std::chrono::milliseconds, std::chrono::steady_clock;
  Program program(argc > 1 ? std::atoi(argv[1]) : 1502);
  const auto begun = steady_clock::now();
  while (program.cycle(std::chrono::duration_cast<microseconds>(steady_clock::now() - begun).count()))
    std::this_thread::sleep_for(milliseconds(1));
}
