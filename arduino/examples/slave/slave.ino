// SPDX-License-Identifier: MIT
// A slave of an EDS file on a Raspberry Pi Pico with an MCP2515: node 42h, whose parameters and address are
// stored. firmware/boards/pico/README.md has the wiring. First make the header of the dictionary, in this folder:
//
//   cbcan-eds --output io_module.hpp io_module.eds
//
// In the menu "Flash Size" choose one with a file system of 64 KB: its first two sectors are the store.
#include <SPI.h>
#include <cbcan.h>
#include <hardware/flash.h>

#include "module.hpp"

using namespace cbcan;

constexpr int kSelect = 17;
constexpr std::uint32_t kCrystal = 8'000'000;  // of the module, as printed on it

struct ArduinoSpi {
  void transfer(std::span<std::uint8_t> bytes) const {
    SPI.beginTransaction(SPISettings(10'000'000, MSBFIRST, SPI_MODE0));
    digitalWrite(kSelect, LOW);
    SPI.transfer(bytes.data(), bytes.size());
    digitalWrite(kSelect, HIGH);
    SPI.endTransaction();
  }
};

extern "C" const std::uint32_t _FS_start[];  // where the file system begins

class TwoSectors final : public boards::Flash {
 public:
  std::span<const std::uint32_t> sector(std::size_t number) const override {
    return {_FS_start + number * FLASH_SECTOR_SIZE / 4, FLASH_SECTOR_SIZE / 4};
  }
  // The flash is written by pages: ones leave the other words as they are.
  bool write(std::size_t number, std::size_t word, std::span<const std::uint32_t> unit) override {
    std::array<std::uint32_t, FLASH_PAGE_SIZE / 4> page;
    page.fill(~0u);
    page[word % page.size()] = unit[0];
    const auto bytes = reinterpret_cast<const std::uint8_t*>(page.data());
    noInterrupts();
    flash_range_program(offset(number) + word / page.size() * FLASH_PAGE_SIZE, bytes, FLASH_PAGE_SIZE);
    interrupts();
    return sector(number)[word] == unit[0];
  }
  bool erase(std::size_t number) override {
    noInterrupts();
    flash_range_erase(offset(number), FLASH_SECTOR_SIZE);
    interrupts();
    return is_erased(sector(number));
  }

 private:
  static std::uint32_t offset(std::size_t number) {
    return reinterpret_cast<std::uintptr_t>(_FS_start) - XIP_BASE + number * FLASH_SECTOR_SIZE;
  }
};

boards::Clock watch;
boards::Mcp2515<ArduinoSpi> can{ArduinoSpi()};
TwoSectors flash;
std::array<std::uint16_t, 2> address = {500, 0x42};  // kbit/s and node ID of a new device
Terminals terminals{0x5A, {1234, -2}};               // instead of pins
Module slave(can, terminals);
boards::ParameterStore store(
    flash, address,
    [](std::span<const std::uint16_t> some) {
      return boards::Mcp2515<ArduinoSpi>::timing(kCrystal, some[0] * 1000u).has_value();
    },
    slave);

Time now() {
  return watch.now(micros());
}

void setup() {
  pinMode(kSelect, OUTPUT);
  digitalWrite(kSelect, HIGH);
  SPI.begin();
  store.start(false);
  can.init(kCrystal, address[0] * 1000u, now());
  slave.keep_in(store);
  slave.start(static_cast<std::uint8_t>(address[1]), now());
}

void loop() {
  for (Frame frame; can.receive(frame);)
    slave.on_frame(frame, now());
  can.poll(now());
  slave.on_bus_state(can.state(), now());
  slave.read_inputs();
  slave.poll(now());
}
