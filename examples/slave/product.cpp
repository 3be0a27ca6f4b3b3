// SPDX-License-Identifier: MIT
// The slave as a product: parameters and node ID in flash, LEDs, a record of faults, a header for a boot
// loader. The microcontroller, a Cortex-M, is fictitious.
#include "boards/common/cortex_m.hpp"
#include "boards/common/fault_record.hpp"
#include "boards/common/image_header.hpp"
#include "boards/common/indicators.hpp"
#include "boards/common/parameter_store.hpp"
#include "module.hpp"

// Your board has these; mps2.cpp and minimal_port.cpp show how.
cbcan::CanPort& can_port();
bool receive(cbcan::Frame& frame);
cbcan::BusState bus_state();
cbcan::Time now();
void sleep_until(cbcan::Time due);
void set_leds(bool run, bool error);
cbcan::regmap::ResetCause reset_cause();
std::uint32_t serial_number();

namespace {

using namespace cbcan;

constexpr std::size_t kSectorWords = 1024;
auto& flash_words = *reinterpret_cast<volatile std::uint32_t (*)[2][kSectorWords]>(0x0801E000);
auto& erase_sector = *reinterpret_cast<volatile std::uint32_t*>(0x40023C00);

// 1. Two sectors: words are written once, sectors are erased.
class TwoSectors final : public boards::Flash {
 public:
  std::span<const std::uint32_t> sector(std::size_t number) const override {
    return {const_cast<const std::uint32_t*>(flash_words[number]), kSectorWords};
  }
  bool write(std::size_t sector, std::size_t word, std::span<const std::uint32_t> unit) override {
    flash_words[sector][word] = unit[0];
    return flash_words[sector][word] == unit[0];
  }
  bool erase(std::size_t number) override {
    erase_sector = static_cast<std::uint32_t>(number);
    return is_erased(sector(number));
  }
};

// 2. Start-up code leaves this memory alone.
[[gnu::section(".noinit")]] boards::FaultRecord faults;

// 3. cmake/seal_image.py writes its CRC after linking.
[[gnu::section(".image_header"), gnu::used]] constinit const boards::ImageHeader header{
    .board = boards::ImageHeader::text("my board")};

TwoSectors flash;
std::array<std::uint16_t, 2> settings{500, 0x42};  // kbit/s and node ID of a new device
Terminals terminals;
Module module(can_port(), terminals);
boards::ParameterStore store(
    flash, settings,
    [](std::span<const std::uint16_t> some) {
      return (some[1] >= 1 && some[1] <= nmt::kMaxNode) || some[1] == EdsDevice::kNoNodeId;
    },
    module);

}  // namespace

void cbcan::boards::on_fault(const Fault& fault) {
  faults.note({fault.pc(), fault.lr(), fault.status});
  system_reset();
}

int main() {
  faults.start(reset_cause());
  store.start(false);  // loads what 1010h and LSS have stored: then the CAN controller gets its bit rate
  module.keep_in(store);
  module.set(io_module::od::kSerialNumber, serial_number());  // an LSS address of its own
  sleep_until(now() + faults.can_wait());  // a device that faults again and again leaves the bus alone
  module.start(static_cast<std::uint8_t>(settings[1]), now());
  boards::Indicators leds;
  for (;;) {
    for (Frame frame; receive(frame);)
      module.on_frame(frame, now());
    module.on_bus_state(bus_state(), now());
    module.read_inputs();
    store.allow_erase(module.device().state() != nmt::State::kOperational);  // it stops the core
    const Time blink = leds.poll(module.device().state(), bus_state(), now());
    set_leds(leds.run(), leds.error());
    sleep_until(earlier(module.poll(now()), blink));
  }
}
