// SPDX-License-Identifier: MIT
#pragma once

/// A node whose frames go through a FaultyPort, a bus with BusFaults, and a master whose frames the test sends.

#include "cbcan/canopen/slave.hpp"
#include "sim/faults/bus_faults.hpp"
#include "sim/faults/faulty_port.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace cbcan::test {

using Texts = std::vector<std::string>;

inline sim::Fault fault_from(const std::string& text, sim::FaultPlace here) {
  sim::FaultOrProblem parsed = sim::parse_fault(text, here);
  if (!parsed.problem.empty()) throw std::invalid_argument(parsed.problem);
  return parsed.fault;
}

/// Records reports of faults.
struct Told final : sim::FaultListener {
  void on_fault(std::string_view text, Time now) override {
    lines.push_back(std::to_string(now) + " " + std::string(text));
  }
  Texts lines;
};

/// 1000h = 191h, 2001h a number, 2010h twenty bytes 0, 1, 2 ...
struct FaultyNode final : sim::Participant, private Application {
  FaultyNode(sim::Bus& bus, sim::Schedule& schedule, std::uint8_t id, sim::FaultListener* listener)
      : Participant(schedule),
        port_(bus.attach(*this)),
        faulty(port_, id, id, listener, [this](Time now) { finish(now); }),
        slave_(id, {kEntries, values_, {}}, buffer_, *this, faulty) {
    port_.accept(nmt::kCommandId, nmt::kCommandId);
    port_.accept(sdo::kRequestId + id, sdo::kRequestId + id);
    port_.accept(nmt::kErrorControlId + id, nmt::kErrorControlId + id);
    restore(0, 0xFFFF, 0);
  }

  void start(Time now) override {
    faulty.set_now(now);
    slave_.start(now);
    poll(now);
  }
  void poll(Time now) override {
    faulty.poll(now);
    slave_.poll(now);
    finish(now);
  }
  void on_frame(const Frame& frame, Time now) override {
    faulty.set_now(now);
    faulty.heard(frame);
    slave_.on_frame(frame, now);
    finish(now);
  }
  void on_bus_state(BusState state, Time now) override {
    if (state == BusState::kBusOff) faulty.drop();
    poll(now);
  }
  /// After each call into the stack.
  void finish(Time now) {
    while (faulty.has_aborted())
      slave_.on_frame(faulty.take_abort(), now);
    wants(earlier(slave_.deadline(), faulty.deadline()));
  }
  sim::Port& port() { return port_; }

 private:
  void on_stored(const ObjectEntry& entry, std::uint8_t, Time now) override {
    if (Slave::owns(entry.index)) slave_.configure(now);
  }
  void restore(std::uint16_t, std::uint16_t, Time) override {
    std::fill(values_.begin(), values_.end(), std::uint8_t{0});
    values_[0] = 0x91;
    values_[1] = 0x01;
    values_[8] = 20;  // the length of 2010h, in front of its value
    std::iota(values_.begin() + 12, values_.end(), std::uint8_t{0});
  }

  static constexpr std::uint16_t kReadWrite = ObjectFlags::kReadWrite | ObjectFlags::kChecked;
  static inline const std::vector<ObjectEntry> kEntries{
      {0x1000, 0, 0, DataType::kUnsigned32, 0, ObjectFlags::kRead, 0, 4},
      {0x1017, 0, 0, DataType::kUnsigned16, 0, kReadWrite, 4, 2},
      {0x2001, 0, 0, DataType::kUnsigned16, 0, kReadWrite, 6, 2},
      {0x2010, 0, 0, DataType::kDomain, 0, kReadWrite | ObjectFlags::kVariable, 12, 20},
  };
  std::vector<std::uint8_t> values_ = std::vector<std::uint8_t>(32);
  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(20);
  sim::Port& port_;

 public:
  sim::FaultyPort faulty;
  sim::FaultSet& faults = faulty.faults();

 private:
  Slave slave_;
};

/// Records every frame but its own, with the time.
struct Master final : sim::Receiver {
  void on_frame(const Frame& frame, Time now) override {
    heard.push_back(std::to_string(now) + " " + text_of(frame));
  }
  void on_bus_state(BusState state, Time now) override {
    heard.push_back(std::to_string(now) + " state " + std::to_string(static_cast<int>(state)));
  }
  Texts heard;
};

/// Bus, node 5, master. Time begins at 0, after the node's boot-up.
struct FaultyPlant {
  explicit FaultyPlant(std::uint32_t bit_rate = 0) : bus(bit_rate), faulty_bus(bus, schedule, 0, &told) {
    master_port.accept(0, 0x7FF);
    node.start(0);
    faulty_bus.start(0);
    pass(0);
    master.heard.clear();
  }

  unsigned set(const std::string& fault) {
    return node.faults.add(fault_from(fault, sim::FaultPlace::kNode), now);
  }
  unsigned set_bus(const std::string& fault) {
    return bus_faults.add(fault_from(fault, sim::FaultPlace::kBus), now);
  }

  /// Frames from the master, each after all immediate effects of the one before.
  void send(const Texts& frames) {
    for (const std::string& frame : frames) {
      CHECK(master_port.try_send(frame_from(frame)));
      pass(0);
    }
  }
  void pass(Time duration) {
    const Time end = now + duration;
    for (Time next = deadline(); next <= end; next = deadline()) {
      now = std::max(now, next);
      bus.advance(now);
      schedule.poll(now);
    }
    now = end;
  }
  Time deadline() const { return earlier(schedule.first_time(), bus.next_deadline()); }

  /// What the master has received since the last call.
  Texts heard() { return std::exchange(master.heard, {}); }

  sim::Bus bus;
  sim::Schedule schedule;
  Told told;
  FaultyNode node{bus, schedule, 5, &told};
  sim::BusFaults faulty_bus;
  sim::FaultSet& bus_faults = faulty_bus.set();
  Master master;
  sim::Port& master_port = bus.attach(master);
  Time now = 0;
};

}  // namespace cbcan::test
