// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/canopen/lss_slave.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

inline constexpr std::uint8_t kNone = LssSlave::kNoNodeId;

using Identity = std::array<std::uint32_t, 4>;
inline constexpr Identity kIdentity{0x00000319, 0x04030201, 0x00010002, 0x12345678};

/// A device behind an LSS slave; what it is told to do is in the log, with the time.
struct LssDevice final : private LssApplication {
  explicit LssDevice(std::uint8_t node_id, const Identity& address = kIdentity)
      : address_(address), slave(*this, port) {
    slave.start(node_id, 4, now);
  }

  void arrive(const std::string& frame) { slave.on_frame(frame_from(frame), now); }
  void ask(const std::string& request, const std::string& response) {
    INFO("after " << request);
    arrive(request);
    CHECK(port.sent == std::deque<std::string>{response});
    port.sent.clear();
  }
  template <class... More>
  void ask_in_vain(const std::string& request, const More&... more) {
    INFO("after " << request);
    arrive(request);
    CHECK(port.sent.empty());
    port.sent.clear();
    if constexpr (sizeof...(more) != 0) ask_in_vain(more...);
  }
  void configuration() { arrive("7E5#0401000000000000"); }
  void waiting() { arrive("7E5#0400000000000000"); }
  void pass(Time duration) {
    const Time end = now + duration;
    while (slave.deadline() <= end) {
      now = slave.deadline();
      slave.poll(now);
    }
    now = end;
  }

 private:
  std::uint32_t identity(std::uint8_t part) const override { return address_.at(part); }
  bool is_bit_rate_supported(std::uint8_t index) const override { return bit_rates && index != 1; }
  void set_on_bus(bool on, Time at) override { note(on ? "on" : "off", at); }
  void activate_bit_rate(std::uint8_t index, Time at) override { note("rate " + std::to_string(index), at); }
  StoreResult store(std::uint8_t node_id, std::uint8_t bit_rate) override {
    note("store " + std::to_string(node_id) + " " + std::to_string(bit_rate), now);
    return storage;
  }
  void on_node_id(std::uint8_t node_id, Time at) override {
    note("node " + std::to_string(node_id), at);
    CHECK(slave.reset_communication(at) == node_id);  // the NMT initialisation that follows
  }
  void note(const std::string& what, Time at) { log.push_back(std::to_string(at) + " " + what); }

  Identity address_;

 public:
  RecordingPort port;
  Time now = 0;
  bool bit_rates = true;
  StoreResult storage = StoreResult::kStored;
  std::vector<std::string> log;
  LssSlave slave;
};

}  // namespace cbcan::test
