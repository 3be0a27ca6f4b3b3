// SPDX-License-Identifier: MIT
#pragma once

/// A simulated bus in virtual time, and a master on it whose frames the test sends. Every frame that the
/// master receives, and every state of its controller, has to be expected, in order and at its time.

#include <exception>

#include "sim/world.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"
#include "support/rows.hpp"

namespace cbcan::test {

inline descriptions::DictionaryImage image_of(const std::vector<ObjectRow>& rows, std::uint8_t node_id = 0) {
  descriptions::DictionaryImage image;
  image.entries = entries_of(rows);
  image.values = values_of(rows, node_id);
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (const ObjectEntry& entry = image.entries[i]; rows[i].follows_node_id)
      image.node_id_values.push_back({entry.offset, 1, static_cast<std::uint8_t>(entry.capacity)});
  return image;
}

/// For NodeParts: makes behaviours of this type.
template <class Behaviour>
std::unique_ptr<sim::Behaviour> behaves_as(sim::DeviceNode& node, std::uint64_t /*seed*/) {
  return std::make_unique<Behaviour>(node);
}

/// Lets time pass until `end`, and advances at deadlines alone.
inline void advance_when_due(sim::World& world, Time& now, Time end) {
  for (Time next = world.next_deadline(); next <= end; next = world.next_deadline()) {
    now = std::max(now, next);
    world.advance(now);
  }
  now = end;
}

struct WorldBench : private sim::Receiver {
  explicit WorldBench(std::uint32_t bit_rate = 0, sim::FaultListener* listener = nullptr)
      : world(bit_rate, 0, listener) {
    port_.accept(0, 0x7FF);
  }
  WorldBench(const WorldBench&) = delete;
  virtual ~WorldBench() noexcept(false) {
    if (std::uncaught_exceptions() == 0) expect_silence();
  }

  /// Power on for all nodes; their boot-up messages are received at the same time.
  WorldBench& start() {
    world.start(now);
    return *this;
  }

  /// Sends a frame of the master; all its immediate effects have happened on return.
  WorldBench& send(const std::string& frame) {
    INFO("sends " << frame);
    CHECK(port_.try_send(frame_from(frame)));
    return pass(0);
  }

  /// Checks the next frame that was received, at `now`.
  template <class... More>
  void expect(const std::string& frame, const More&... more) {
    expect_at(now, frame);
    if constexpr (sizeof...(more) != 0) expect(more...);
  }
  void expect_at(Time time, const std::string& frame) {
    if (heard_.empty()) {
      FAIL_CHECK("nothing is heard at " << now << "; expected " << frame);
      return;
    }
    CHECK(heard_.front().second == frame);
    CHECK(heard_.front().first == time);
    heard_.pop_front();
  }
  void expect_silence() {
    for (const auto& [time, frame] : heard_)
      FAIL_CHECK("not expected: " << time << " " << frame);
    heard_.clear();
  }
  void ask(const std::string& request, const std::string& response) {
    INFO("asked " << request);
    expect_silence();
    send(request);
    expect(response);
    expect_silence();
  }

  /// SDO downloads, each confirmed with its object: "605#2B17106400..." by "585#60171000000000...".
  template <class... More>
  void write(const std::string& request, const More&... more) {
    const std::string node = text_of(Frame{frame_from(request).id - 0x80, 0, 0, {}});
    ask(request, node + "60" + request.substr(6, 6) + "00000000");
    if constexpr (sizeof...(more) != 0) write(more...);
  }

  /// All frames since the last call of this or of expect(), whatever their time.
  std::vector<std::string> heard() {
    std::vector<std::string> frames;
    for (auto& [time, frame] : heard_)
      frames.push_back(std::move(frame));
    heard_.clear();
    return frames;
  }
  /// "55000 082#3081110000000000"
  std::vector<std::string> heard_with_times() {
    std::vector<std::string> lines;
    for (const auto& [time, frame] : heard_)
      lines.push_back(std::to_string(time) + " " + frame);
    heard_.clear();
    return lines;
  }

  WorldBench& pass(Time duration) {
    advance_when_due(world, now, now + duration);
    return *this;
  }

  // What happens to the nodes from outside.
  WorldBench& input(sim::Node& node, std::uint16_t index, std::uint8_t sub, double value) {
    CHECK(node.set_input(index, sub, value, now));
    return pass(0);
  }
  WorldBench& incident(sim::Node& node, const std::string& name, bool present) {
    CHECK(node.set_incident(name, present, now));
    return pass(0);
  }

  sim::World world;
  Time now = 0;

 private:
  void on_frame(const Frame& frame, Time at) override { heard_.emplace_back(at, text_of(frame)); }
  void on_bus_state(BusState state, Time at) override {
    heard_.emplace_back(at, "state " + std::to_string(static_cast<int>(state)));
  }

  std::deque<std::pair<Time, std::string>> heard_;

 protected:
  sim::Port& port_ = world.bus().attach(*this);
};

}  // namespace cbcan::test
