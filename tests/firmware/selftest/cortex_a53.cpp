// SPDX-License-Identifier: MIT
#include "cortex_a53.hpp"

#include "boards/common/registers.hpp"
#include "two_controllers.hpp"

namespace cbcan::test {

namespace {

// GICv2: distributor and processor interface.
constexpr boards::Mmio distributor(kDistributor);
constexpr std::uint32_t kDistributorControl = 0x000;
constexpr std::uint32_t kSetEnable = 0x100;
constexpr std::uint32_t kClearEnable = 0x180;
// One byte for each interrupt.
constexpr std::uint32_t kPriority = 0x400;
constexpr std::uint32_t kTargets = 0x800;

constexpr boards::Mmio processor(kProcessorInterface);
constexpr std::uint32_t kProcessorControl = 0x00;
constexpr std::uint32_t kPriorityMask = 0x04;
constexpr std::uint32_t kAcknowledge = 0x0C;
constexpr std::uint32_t kEndOfInterrupt = 0x10;

constexpr std::uint32_t kEnable = 1;
constexpr std::uint32_t kLetAllThrough = 0xFF;
constexpr std::uint32_t kMiddlePriority = 0x80;
constexpr std::uint32_t kThisProcessor = 0x01;
constexpr std::uint32_t kIdMask = 0x3FF;
constexpr std::uint32_t kFirstSpecialId = 1020;

/// Sets the byte of interrupt `id` in the words from `first` on.
void set_byte(std::uint32_t first, std::uint32_t id, std::uint32_t value) {
  const std::uint32_t shift = id % 4 * 8;
  boards::Mmio registers = distributor;
  boards::modify(registers, first + id / 4 * 4, 0xFFu << shift, value << shift);
}

}  // namespace

void start_interrupts() {
  distributor.write(kDistributorControl, kEnable);
  processor.write(kPriorityMask, kLetAllThrough);
  processor.write(kProcessorControl, kEnable);
  asm volatile("msr daifclr, #2" ::: "memory");
}

void enable_interrupt(std::uint32_t id) {
  set_byte(kPriority, id, kMiddlePriority);
  set_byte(kTargets, id, kThisProcessor);
  distributor.write(kSetEnable + id / 32 * 4, 1u << id % 32);
}

void disable_interrupt(std::uint32_t id) {
  distributor.write(kClearEnable + id / 32 * 4, 1u << id % 32);
}

/// Called by the vector (startup.cpp).
extern "C" void dispatch_interrupt() {
  const std::uint32_t acknowledged = processor.read(kAcknowledge);
  const std::uint32_t id = acknowledged & kIdMask;
  if (id >= kFirstSpecialId) return;  // no longer pending
  on_interrupt(id);
  processor.write(kEndOfInterrupt, acknowledged);
}

Time now() {
  constexpr std::uint64_t kMicroseconds = 1'000'000;
  std::uint64_t count, frequency;
  asm volatile("isb\n\tmrs %0, cntvct_el0" : "=r"(count));
  asm("mrs %0, cntfrq_el0" : "=r"(frequency));
  return count / frequency * kMicroseconds + count % frequency * kMicroseconds / frequency;
}

}  // namespace cbcan::test
