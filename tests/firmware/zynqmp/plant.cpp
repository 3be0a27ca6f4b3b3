// SPDX-License-Identifier: MIT
#include "plant.hpp"

#include <algorithm>

namespace cbcan::test {

namespace {

using Flags = ObjectFlags;

constexpr std::array kEntries{
    ObjectEntry{0x1017, 0, 0, DataType::kUnsigned16, Flags::kReadWrite | Flags::kChecked, 0, 2},
    ObjectEntry{0x2000, 0, 0, DataType::kUnsigned32, Flags::kReadWrite, 4, 4},
    ObjectEntry{0x2001, 0, 0, DataType::kVisibleString, Flags::kReadWrite | Flags::kVariable, 12, 32},
    ObjectEntry{0x2002, 0, 0, DataType::kDomain, Flags::kReadWrite, 48, 128},
    ObjectEntry{0x2003, 0, 0, DataType::kUnsigned16, Flags::kRead, 176, 2},
};

}  // namespace

Device::Device(CanPort& port) : slave(kNode, {kEntries, values_, {}}, buffer_, *this, port) {}

/// Power-on: 2000h = 12345678h, everything else 0 or empty.
void Device::restore(std::uint16_t first_index, std::uint16_t last_index) {
  static constexpr std::array<std::uint8_t, 192> kPowerOn{0, 0, 0, 0, 0x78, 0x56, 0x34, 0x12};
  restore_values(kEntries, kPowerOn, values_, first_index, last_index);
  ++resets;
}

bool Plant::start() {
  constexpr std::uint32_t kClock = 24'000'000;
  constexpr std::uint32_t kBitRate = 500'000;
  boards::enable_interrupt(boards::kCan0Interrupt);
  boards::enable_interrupt(boards::kCan1Interrupt);
  boards::start_interrupts();
  if (can0.start({kClock, kBitRate, kOwnNode}) != Can::Start::kDone) return false;
  if (can1.start({kClock, kBitRate, kNode}) != Can::Start::kDone) return false;
  coprocessor.start(boards::now());
  device.slave.start(boards::now());
  return true;
}

void Plant::turn() {
  Frame frame;
  while (can1.receive(frame))
    device.slave.on_frame(frame, boards::now());
  while (can0.receive(frame))
    coprocessor.on_frame(frame, boards::now());
  const Time now = boards::now();
  bus_state = can0.poll(now);
  coprocessor.on_bus_state(bus_state);
  coprocessor.poll(now);
  can1.poll(now);
  device.slave.poll(now);
}

std::uint16_t Plant::execute(std::initializer_list<std::uint16_t> request) {
  std::copy(request.begin(), request.end(), words.begin() + 1);
  std::atomic_ref<std::uint16_t> flag(words[0]);
  flag.store(0xCA0E, std::memory_order_release);
  const Time end = boards::now() + 5 * kSecond;
  while (flag.load(std::memory_order_acquire) == 0xCA0E && boards::now() < end)
    turn();
  return flag.load(std::memory_order_acquire);
}

}  // namespace cbcan::test

void cbcan::boards::on_interrupt(std::uint32_t id) {
  using test::plant;
  const bool second = id == kCan1Interrupt;
  plant.interrupts[second].fetch_add(1, std::memory_order_relaxed);
  (second ? plant.can1 : plant.can0).on_interrupt();
}
