// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "The scanner window": a complete PLC program, exchange by exchange, with a
// disturbance at each step.

#include "contract/window.hpp"
#include "support/scanner_plc.hpp"

using namespace cbcan::contract;
using cbcan::test::ScannerPlc;

namespace {

using Bytes = cbcan::test::CountingNode::Bytes;

Bytes bytes_of(const std::string& frame) {
  Bytes bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(std::stoul(frame.substr(4 + 2 * i, 2), nullptr, 16));
  return bytes;
}

/// A PLC program, its Modbus master, a module, and a slow node.
struct Plant {
  // One step each, called in the order of the exchange.
  void scan() { plc.scan(); }
  void write() {
    written_ = Words(plc.out.begin(), plc.out.end());
    target_->write(kOut, written_);
  }
  void read() { take(target_->read(kIn, plc.in.size())); }
  void write_and_read() {
    take(target_->write_and_read(kOut, Words(plc.out.begin(), plc.out.end()), kIn, plc.in.size()));
  }
  void write_if_changed() {
    if (!std::equal(plc.out.begin(), plc.out.end(), written_.begin(), written_.end())) write();
  }
  void node_takes() {
    for (std::string frame = target_->next_frame(); !frame.empty(); frame = target_->next_frame())
      if (frame.starts_with("605#")) node.on_request(bytes_of(frame));
  }
  void node_responds() {
    for (; !node.responses.empty(); node.responses.pop_front())
      target_->arrive("585#" + hex_of(node.responses.front()));
  }

  // Disturbances.
  void module_restarts() {
    node_takes();
    node.responses.clear();
    target_ = make_target({});
  }
  void zeros() { target_->write(kOut, Words(plc.out.size())); }
  void pass(Duration duration) { target_->pass(duration); }

  /// In 20 steps there are one or two requests, with a scan of the PLC between any two exchanges.
  static constexpr unsigned kSteps = 20;
  void step(unsigned number) {
    using Step = void (Plant::*)();
    static constexpr Step kCycle[] = {&Plant::scan, &Plant::write,         &Plant::scan, &Plant::node_takes,
                                      &Plant::read, &Plant::node_responds, &Plant::scan, &Plant::read};
    (this->*kCycle[number % std::size(kCycle)])();
  }
  /// Continues until so many requests have succeeded.
  void go_on(unsigned requests) {
    constexpr unsigned kMost = 500;
    const std::size_t enough = plc.done.size() + requests;
    unsigned number = 0;
    while (plc.done.size() < enough && number < kMost)
      step(number++);
    CHECK(number < kMost);
  }

  ScannerPlc plc{100};
  cbcan::test::CountingNode node;

 private:
  void take(const Words& words) { std::copy(words.begin(), words.end(), plc.in.begin()); }

  std::unique_ptr<Target> target_ = make_target({});
  Words written_;
};

/// Calls `disturb` before each step of a running program; then the program must continue.
template <class Disturb>
void at_each_step(Disturb disturb) {
  Plant plant;
  plant.go_on(2);
  for (unsigned at = 0; at < Plant::kSteps; ++at) {
    INFO("before step " << at);
    for (unsigned number = 0; number < at; ++number)
      plant.step(number);
    disturb(plant);
    plant.go_on(2);
  }
  plant.plc.check(plant.node);
}

}  // namespace

TEST_CASE("[SCAN-1] [SCAN-3] [SCAN-4] whole blocks in each order of exchange, nodes of 0, 120 and 250 ms") {
  const auto period = GENERATE(20ms, 100ms);
  const auto cycles = GENERATE(0, 120, 250) / static_cast<int>(period / 1ms);
  const auto order = GENERATE(0, 1, 2, 3);
  constexpr unsigned kRequests = 4;
  INFO("period " << period.count() << " ms, node of " << cycles << " periods, order " << order);
  Plant plant;
  int waited = 0;
  for (unsigned i = 0; i < 40 * kRequests && plant.plc.ended <= kRequests; ++i) {
    if (order == 0) plant.read();
    if (order == 2) plant.write_and_read();
    plant.scan();
    if (order == 3) plant.write_if_changed();
    if (order < 2) plant.write();
    plant.scan();
    plant.node_takes();
    if (!plant.node.responses.empty() && waited++ >= cycles) {
      plant.node_responds();
      waited = 0;
    }
    if (order == 1 || order == 3) plant.read();
    plant.pass(period);
  }
  CHECK(plant.plc.results == std::map<std::uint16_t, unsigned>{{0, kRequests}, {5, 1}});
  CHECK(plant.node.transfers - kRequests <= 1);
  plant.plc.check(plant.node);
}

TEST_CASE("[SCAN-11] [SCAN-18] the module restarts, at each step") {
  at_each_step([](Plant& plant) { plant.module_restarts(); });
}

TEST_CASE("[SCAN-18] the PLC restarts, at each step") {
  at_each_step([](Plant& plant) { plant.plc.restart(); });
}

TEST_CASE("[SCAN-4] [SCAN-6] STOP with outputs of 0, at each step") {
  at_each_step([](Plant& plant) {
    for (int i = 0; i < 3; ++i) {
      plant.zeros();
      plant.node_takes();
      plant.node_responds();
      plant.read();
    }
  });
}

TEST_CASE("[SCAN-4] [SCAN-6] a gateway writes zeros and restores what was there, at each step") {
  at_each_step([](Plant& plant) {
    plant.zeros();
    plant.write();
  });
}

TEST_CASE("[SCAN-3] [SCAN-4] the connection is lost for a while, at each step") {
  at_each_step([](Plant& plant) {
    plant.scan();
    plant.node_takes();
    plant.pass(200ms);
    plant.node_responds();
    plant.scan();
  });
}
