// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/coprocessor/coprocessor.hpp"
#include "support/scanner_plc.hpp"

namespace cbcan::test {

/// A module with its registers, which may be switched off and on, and node 5 on its bus.
struct ScannedModule final : CanPort {
  explicit ScannedModule(std::uint16_t sdo_timeout_ms) {
    settings_.sdo_timeout_ms = sdo_timeout_ms;
    power_on();
  }

  void power_on() {
    registers.fill(0);
    node.responses.clear();
    due_.clear();
    const std::span<std::uint16_t, regmap::kRegisterFileWords> all(registers);
    coprocessor.emplace(RegisterWindow(all.subspan<regmap::kWindowFirst, regmap::kWindowWords>()),
                        all.subspan<regmap::kProcessFirst, regmap::kProcessWords>(), *this, settings_,
                        ScannerWindow(all.subspan<regmap::kScannerOutFirst, regmap::kScannerOutWords>(),
                                      all.subspan<regmap::kScannerInFirst, regmap::kScannerInWords>()));
    coprocessor->start(now);
    poll();
  }

  /// The bus.
  bool try_send(const Frame& frame) override {
    if (frame.id == 0x600u + kScannedNode) node.on_request(frame.data);
    while (due_.size() < node.responses.size())
      due_.push_back(now + node_delay);
    return true;
  }

  void poll() {
    while ((deadline_ = coprocessor->poll(now)) <= now) {
    }
  }

  /// What one request of the PLC does.
  void store(std::size_t first, std::span<const std::uint16_t> words) {
    std::copy(words.begin(), words.end(), registers.begin() + static_cast<std::ptrdiff_t>(first));
  }
  void written(std::size_t first, std::size_t count) {
    coprocessor->on_registers_written(first, count, now);
    poll();
  }
  void write(std::size_t first, std::span<const std::uint16_t> words) {
    store(first, words);
    written(first, words.size());
  }
  template <std::size_t Count>
  void read(std::size_t first, std::array<std::uint16_t, Count>& words) const {
    std::copy_n(registers.begin() + static_cast<std::ptrdiff_t>(first), Count, words.begin());
  }

  void deliver_response() {
    if (node.responses.empty()) return;
    const Frame frame{.id = 0x580u + kScannedNode, .length = 8, .data = node.responses.front()};
    lose_response();
    coprocessor->on_frame(frame, now);
    poll();
  }
  void lose_response() {
    if (node.responses.empty()) return;
    node.responses.pop_front();
    due_.pop_front();
  }

  /// Time passes without a response.
  void pass(Time duration) {
    now += duration;
    poll();
  }
  /// Time passes, in which the node responds after `node_delay`.
  void run(Time duration) {
    const Time end = now + duration;
    while (true) {
      const Time next = earlier(deadline_, due_.empty() ? kNever : due_.front());
      if (next > end) break;
      now = std::max(now, next);
      if (!due_.empty() && due_.front() <= now)
        deliver_response();
      else
        poll();
    }
    pass(end - now);
  }

  std::array<std::uint16_t, regmap::kRegisterFileWords> registers{};
  CountingNode node;
  Time node_delay = 0;
  std::optional<Coprocessor> coprocessor;
  Time now = 1000;

 private:
  Coprocessor::Settings settings_;
  std::deque<Time> due_;  ///< of the responses
  Time deadline_ = 0;
};

}  // namespace cbcan::test
