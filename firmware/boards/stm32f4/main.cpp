// SPDX-License-Identifier: MIT
// The coprocessor on an STM32F446: board.hpp with settings.hpp.

#include "boards/common/cortex_m.hpp"
#include "boards/common/image_header.hpp"
#include "boards/common/parameter_store.hpp"
#include "boards/stm32f4/board.hpp"
#include "boards/stm32f4/flash_memory.hpp"

namespace {

using namespace cbcan;
using namespace cbcan::boards;
using stm32f4::kBoardSettings;

static_assert(stm32f4::settings_of(stm32f4::words_of(kBoardSettings)),
              "settings.hpp: one of kBoardSettings is none that the board can do with (R4150.. in "
              "docs/reference/registers.md)");

constexpr std::uintptr_t kVectorTableOffset = 0xE000ED08;  // VTOR (ARM DDI 0403, B3.2.5)

constexpr std::uintptr_t kFlashBase = 0x40023C00, kRccBase = 0x40023800, kPortCBase = 0x40020800;

[[gnu::section(".noinit")]] FaultRecord faults;

stm32f4::FlashMemory<Mmio> flash(Mmio(kFlashBase), Mmio(stm32f4::kStoreBase),
                                 reinterpret_cast<const std::uint32_t*>(stm32f4::kStoreBase));
stm32f4::Words words = stm32f4::words_of(kBoardSettings);
ParameterStore store(flash, words, [](std::span<const std::uint16_t> some) {
  return stm32f4::settings_of(some).has_value();
});

/// Without those in flash while the blue button of a Nucleo, which pulls PC13 down, is held.
const stm32f4::Settings settings = [] {
  constexpr std::uint32_t kPortC = 1u << 2;
  stm32f4::Rcc<Mmio>(Mmio(kRccBase), Mmio(kFlashBase)).enable(kPortC, 0, 0);
  store.start(!stm32f4::Gpio<Mmio>(Mmio(kPortCBase)).read(13));
  return stm32f4::settings_of(words).value_or(kBoardSettings);
}();
stm32f4::Board board(settings, faults);
stm32f4::TheStation station(board, {&board.can()}, stm32f4::station_settings(settings, words));

[[gnu::section(".vectors"), gnu::used]] constinit const auto vectors = [] {
  VectorTable<stm32f4::kInterrupts> table;
  table.nmi = [] { board.on_nmi(); };
  table.interrupts.fill(fault_handler);
  for (const std::size_t received : {stm32f4::kCan1Rx0Interrupt, stm32f4::kCan1Rx1Interrupt})
    table.interrupts[received] = [] { board.on_can_received(); };
  table.interrupts[stm32f4::kCan1SceInterrupt] = [] { board.on_can_error(); };
  table.interrupts[stm32f4::kTim2Interrupt] = [] { board.on_timer(); };
  for (const std::size_t usart : {stm32f4::kUsart1Interrupt, stm32f4::kUsart2Interrupt})
    table.interrupts[usart] = [] { board.on_modbus(); };
  return table;
}();

[[gnu::section(".image_header"), gnu::used]] constinit const ImageHeader header{
    .board = ImageHeader::text("stm32f446")};

}  // namespace

/// The PLC sees the fault: R4133 counts it, and the reset cause is software, which only this function causes.
void cbcan::boards::on_fault(const Fault& fault) {
  faults.note({fault.pc(), fault.lr(), fault.status});
  system_reset();
}

int main() {
  // If a boot loader started the program, address 0 has other vectors.
  Mmio(kVectorTableOffset).write(0, reinterpret_cast<std::uintptr_t>(&vectors));
  board.start(station.modbus());
  faults.show(station.registers().diagnostics);
  station.keep_in(store);
  station.start();
  for (;;)
    board.sleep_until(station.turn(), station.coprocessor().own_node().state());
}
