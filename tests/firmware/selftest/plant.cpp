// SPDX-License-Identifier: MIT
#include "plant.hpp"

#include <algorithm>

namespace cbcan::test {

bool Plant::start() {
  constexpr std::uint32_t kBitRate = 500'000;
  if (!prepare()) return false;
  for (const std::uint32_t id : kInterrupts)
    enable_interrupt(id);
  start_interrupts();
  if (can0.start({kClock, kBitRate, kOwnNode}) != Can::Start::kDone) return false;
  if (can1.start({kClock, kBitRate, kNode}) != Can::Start::kDone) return false;
  coprocessor.start(now());
  device.slave.start(now());
  return true;
}

void Plant::turn() {
  Frame frame;
  while (can1.receive(frame))
    device.slave.on_frame(frame, now());
  while (can0.receive(frame))
    coprocessor.on_frame(frame, now());
  const Time time = now();
  bus_state = can0.poll(time);
  coprocessor.on_bus_state(bus_state, time);
  coprocessor.poll(time);
  can1.poll(time);
  device.slave.poll(time);
}

std::uint16_t Plant::execute(std::initializer_list<std::uint16_t> request) {
  std::copy(request.begin(), request.end(), words.begin() + 1);
  std::atomic_ref<std::uint16_t> flag(words[0]);
  flag.store(0xCA0E, std::memory_order_release);
  const Time end = now() + 5 * kSecond;
  while (flag.load(std::memory_order_acquire) == 0xCA0E && now() < end)
    turn();
  return flag.load(std::memory_order_acquire);
}

void on_interrupt(std::uint32_t id) {
  const bool second = id == kInterrupts[1];
  plant.interrupts[second].fetch_add(1, std::memory_order_relaxed);
  (second ? plant.can1 : plant.can0).on_interrupt();
}

}  // namespace cbcan::test
