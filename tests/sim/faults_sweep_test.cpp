// SPDX-License-Identifier: MIT
// A coprocessor and a node with every fault of SDO responses, in every transfer mode, at every step: there is
// one result in time, and the next transaction, without the fault, succeeds.
#include "sim/faulty_plant.hpp"

using namespace cbcan;
using cbcan::sim::FaultKind;
using namespace cbcan::test;

namespace {

constexpr Time kTimeout = 1000 * kMillisecond;

/// Module and node 5 on one bus.
struct Plant : ModulePlant {
  Plant() {
    world.bus().attach(requests).accept(0x605, 0x605);
    world.start(0);
    pass(kMillisecond);
  }

  /// Returns how long it took.
  Time execute(std::initializer_list<std::uint16_t> words, Time most) {
    const Time begun = now;
    request(words);
    while (reg(3700) == 0xCA0E && world.next_deadline() <= begun + most) {
      now = std::max(now, world.next_deadline());
      world.advance(now);
    }
    return now - begun;
  }

  sim::Node& node = world.add_node(faulty_node());
  cbcan::test::Master requests;  ///< of the module to node 5
};

struct Transfer {
  const char* name;
  bool write;
  std::uint16_t mode;
  std::uint16_t index;
  std::uint16_t size;
};
constexpr Transfer kTransfers[] = {
    {"expedited read", false, 0, 0x1000, 4},  {"expedited write", true, 0, 0x2001, 2},
    {"segmented read", false, 2, 0x2010, 20}, {"segmented write", true, 2, 0x2010, 20},
    {"block read", false, 3, 0x2010, 20},     {"block write", true, 3, 0x2010, 20},
};

constexpr std::uint16_t kReadCommand = 5055;
constexpr std::uint16_t kWrite = 5066;

Time run(Plant& plant, const Transfer& transfer, Time most) {
  if (!transfer.write) return plant.execute({kReadCommand, 5, transfer.index, 0, transfer.size}, most);
  for (unsigned i = 0; i < 10; ++i)
    plant.reg(3706 + i) = static_cast<std::uint16_t>(0x0100 + i * 0x0202);  // 00 01 02 03 ...
  return plant.execute({kWrite, 5, transfer.index, 0, transfer.size}, most);
}

/// The registers hold the value of the object.
bool has_read_right(Plant& plant, const Transfer& transfer) {
  if (transfer.index == 0x1000) return plant.reg(3706) == 0x0191 && plant.reg(3707) == 0;
  if (transfer.index == 0x2001) return plant.reg(3706) == 0x0100;
  for (unsigned i = 0; i < 10; ++i)
    if (plant.reg(3706 + i) != 0x0100 + i * 0x0202) return false;
  return plant.reg(3705) == 20;
}

/// At most one, and no frame after it.
void check_one_abort(const cbcan::test::Texts& requests) {
  const auto is_abort = [](const std::string& line) { return line.find("605#80") != std::string::npos; };
  CHECK(requests.end() - std::find_if(requests.begin(), requests.end(), is_abort) <= 1);
}

void check_next(Plant& plant, const Transfer& transfer) {
  // The quarantine may delay it by one timeout, since a response that is 1.5 s late may still follow.
  CHECK(run(plant, transfer, 2 * kTimeout) <= kTimeout + kMillisecond);
  CHECK(plant.reg(3700) == 0);
  if (transfer.write) plant.execute({kReadCommand, 5, transfer.index, 0, transfer.size}, kTimeout);
  CHECK(plant.reg(3700) == 0);
  CHECK(has_read_right(plant, transfer));
}

/// The fault falsifies a response so that no client can detect it.
bool is_believable(FaultKind kind, const std::string& fault) {
  return kind == FaultKind::kResponseOtherSize || fault == "duplicate-node-id";
}

/// False: no response of this transfer matches.
bool sweep(const Transfer& transfer, const std::string& text, bool always) {
  Plant plant;
  plant.execute({kWrite, 0, 0x3004, 0, 1, transfer.mode}, 0);
  const cbcan::sim::Fault fault = fault_from(text, cbcan::sim::FaultPlace::kNode);
  plant.node.faults().add(fault, plant.now);
  INFO(transfer.name << ": " << text);
  const Time most = always ? 10 * kTimeout : 2 * kTimeout;
  CHECK(run(plant, transfer, 20 * kTimeout) <= most);
  check_one_abort(plant.requests.heard);
  const bool fired = plant.node.faults().list()[0].fired != 0;
  const std::uint16_t result = plant.reg(3700);
  CHECK((result == 0 || result == 4));
  if (result == 0 && !transfer.write && !is_believable(fault.kind, text))
    CHECK(has_read_right(plant, transfer));
  plant.node.faults().clear(plant.now);
  check_next(plant, transfer);
  return fired;
}

const char* const kFaults[] = {
    "response-never",
    "response-late delay_ms=500",
    "response-late delay_ms=1500",
    "response-twice",
    "response-twice delay_ms=200",
    "response-out-of-order delay_ms=20",
    "response-out-of-order delay_ms=1200",
    "response-other-toggle",
    "response-other-specifier",
    "response-other-specifier specifier=0",
    "response-other-index",
    "response-other-index other_sub=1",
    "response-other-size",
    "response-other-size size=0",
    "response-other-size size=0xFFFFFFFF",
    "response-other-crc",
    "response-other-sequence",
    "abort",
    "abort code=0",
    "short-frame",
    "short-frame length=0",
    "silent",
    "duplicate-node-id",
};

}  // namespace

TEST_CASE("Every fault of responses, once at every step: one result in time, then all is well") {
  unsigned fired = 0;
  for (const Transfer& transfer : kTransfers) {
    for (const std::string fault : kFaults)
      for (int after = 0; sweep(transfer, fault + " count=1 after=" + std::to_string(after), false); ++after)
        ++fired;
  }
  CHECK(fired > 300);
}

TEST_CASE("Every fault of responses, all the time: a result within ten SDO timeouts, then all is well") {
  for (const Transfer& transfer : kTransfers)
    for (const std::string fault : kFaults)
      sweep(transfer, fault, true);
}

TEST_CASE("Storms, a wrong state and a heartbeat that stops do not disturb the transfers of a module") {
  for (const char* const fault :
       {"boot-up-storm", "emcy-storm interval_ms=1", "state-wrong", "heartbeat-stops"}) {
    for (const Transfer& transfer : kTransfers) {
      INFO(transfer.name << ": " << fault);
      Plant plant;
      plant.execute({kWrite, 0, 0x3004, 0, 1, transfer.mode}, 0);
      plant.node.faults().add(fault_from(fault, cbcan::sim::FaultPlace::kNode), plant.now);
      plant.pass(55 * kMillisecond);
      check_next(plant, transfer);
    }
  }
}
