// SPDX-License-Identifier: MIT
#pragma once

/// What every board runs: the PLC's registers, a Modbus RTU server in front of them, the coprocessor behind
/// them, and the diagnostics registers (docs/registers.md). With several CAN networks each has registers, a
/// coprocessor, a port and a station address of its own (docs/contract.md). A board's program is
///
///   station.start();
///   for (;;) sleep_until(station.turn());
///
/// where sleep_until() returns early after any interrupt. Interrupts hand bytes to modbus().on_byte() and
/// frames to whatever Hardware::receive() reads; everything else happens in turn(). So a Modbus request is
/// applied whole between two polls of the coprocessor, and its answer shows a window with results before the
/// flag.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "boards/common/hardware.hpp"
#include "coprocessor/coprocessor.hpp"
#include "modbus/rtu_server.hpp"

namespace cbcan::boards {

/// R0..R4167 of one network.
using RegisterFile = std::span<std::uint16_t, regmap::kRegisterFileWords>;

/// Writes the diagnostics registers.
void publish(RegisterFile registers, Time now, const Health& health, BusState bus_state,
             const RtuServer::Counters& modbus, const Coprocessor::Counters& transactions);

template <std::size_t kNetworks = 1>
class Station {
 public:
  /// Of the first network, then of the next ones; the board's memory, zeros at the start.
  using Registers = std::span<std::uint16_t, kNetworks * regmap::kRegisterFileWords>;
  using Ports = std::array<CanPort*, kNetworks>;

  struct Settings {
    std::uint8_t station = 1;     ///< Modbus address of the first network, of all of them within 1..247
    std::uint32_t gap_us = 1750;  ///< see RtuServer::Settings
    std::array<Coprocessor::Settings, kNetworks> coprocessors;
  };

  /// All live as long as the station.
  Station(Registers registers, Hardware& hardware, const Ports& ports, const Settings& settings)
      : Station(registers, hardware, ports, settings, std::make_index_sequence<kNetworks>()) {}

  RtuServer& modbus() { return modbus_; }
  const Coprocessor& coprocessor(std::size_t network = 0) const { return coprocessors_[network]; }

  /// Sends the boot-up message of each network.
  void start() {
    for (Coprocessor& coprocessor : coprocessors_)
      coprocessor.start(hardware_.now());
  }

  /// Takes what has arrived, executes at most one Modbus request, and does what is due. Returns the time of
  /// the next turn at the latest; kNever = only after an interrupt.
  Time turn() {
    const Time now = hardware_.now();
    for (std::size_t network = 0; network < kNetworks; ++network)
      take_frames(network, now);
    if (modbus_.request_reads(regmap::kDiagnosticsFirst, regmap::kDiagnosticsWords))
      publish_for(kNetworks == 1 ? 0 : modbus_.request_network(), now);
    if (modbus_.request_waiting()) execute(now);
    Time due = kNever;
    for (Coprocessor& coprocessor : coprocessors_)
      due = earlier(due, coprocessor.poll(now));
    return due;
  }

 private:
  template <std::size_t... kNetwork>
  Station(Registers registers, Hardware& hardware, const Ports& ports, const Settings& settings,
          std::index_sequence<kNetwork...> /*networks*/)
      : registers_(registers),
        hardware_(hardware),
        modbus_(registers, {settings.station, kNetworks, settings.gap_us, regmap::kDiagnosticsFirst,
                            regmap::kDiagnosticsWords}),
        coprocessors_{Coprocessor(window(kNetwork), process_data(kNetwork), *ports[kNetwork],
                                  settings.coprocessors[kNetwork])...} {}

  RegisterFile registers_of(std::size_t network) const {
    return registers_.subspan(network * regmap::kRegisterFileWords)
        .template first<regmap::kRegisterFileWords>();
  }
  RegisterWindow window(std::size_t network) const {
    return RegisterWindow(
        registers_of(network).template subspan<regmap::kWindowFirst, regmap::kWindowWords>());
  }

  ProcessRegisters process_data(std::size_t network) const {
    return registers_of(network).template subspan<regmap::kProcessFirst, regmap::kProcessWords>();
  }

  void take_frames(std::size_t network, Time now) {
    Frame frame;
    while (hardware_.receive(network, frame))
      coprocessors_[network].on_frame(frame, now);
    coprocessors_[network].on_bus_state(hardware_.bus_state(network), now);
  }

  void execute(Time now) {
    if (const auto response = modbus_.poll(); !response.empty()) hardware_.respond(response);
    for (Coprocessor& coprocessor : coprocessors_)
      coprocessor.on_registers_written(now);
  }

  /// Fresh for whoever asks; nobody else needs them.
  void publish_for(std::size_t network, Time now) {
    publish(registers_of(network), now, hardware_.health(network), hardware_.bus_state(network),
            modbus_.counters(), coprocessors_[network].counters());
  }

  Registers registers_;
  Hardware& hardware_;
  RtuServer modbus_;
  std::array<Coprocessor, kNetworks> coprocessors_;
};

}  // namespace cbcan::boards
