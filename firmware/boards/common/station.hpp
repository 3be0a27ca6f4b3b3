// SPDX-License-Identifier: MIT
#pragma once

/// What every board runs: the PLC's registers, a Modbus RTU server and a coprocessor that access them, and
/// the diagnostics registers (docs/reference/registers.md). With several CAN networks each has its own
/// registers, coprocessor, port and station address (docs/reference/contract.md). A board's program is
///
///   station.start();
///   for (;;) sleep_until(station.turn());
///
/// where sleep_until() returns early after any interrupt. Interrupts pass bytes to modbus().on_byte(), with
/// the low 32 bits of Hardware::now(), and frames to the queue that Hardware::receive() reads; everything
/// else happens in turn(). So a Modbus request is applied whole between two polls of the coprocessor, and a
/// response that shows the cleared flag also shows the results.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "boards/common/hardware.hpp"
#include "cbcan/coprocessor/coprocessor.hpp"
#include "cbcan/modbus/rtu_server.hpp"

namespace cbcan::boards {

using Diagnostics = std::span<std::uint16_t, regmap::kDiagnosticsWords>;

/// Writes the diagnostics registers.
void publish(Diagnostics registers, Time now, const Health& health, BusState bus_state,
             const RtuServer::Counters& modbus, const Coprocessor::Counters& transactions);

/// Memory for the objects of a network that the module boots, in which SDO clients write them.
inline constexpr std::size_t kNetworkBytes = 2048;

/// The registers of one network; other addresses are answered with exception 02.
struct Registers {
  Registers(const Coprocessor::Settings& settings, std::span<std::uint16_t> board)
      : map{{
            {regmap::kWindowFirst, window},
            {settings.scanner_out_first, scanner_out},
            {settings.scanner_in_first, scanner_in},
            {settings.process_first, process_data},
            {settings.status_first, status, false, true},
            {regmap::kDiagnosticsFirst, diagnostics, true},
            {regmap::kNodeRequest, node_requests},
            {regmap::kBoardFirst, board},
        }} {}
  Registers(const Registers&) = delete;
  Registers& operator=(const Registers&) = delete;

  std::array<std::uint16_t, regmap::kWindowWords> window{};
  std::array<std::uint16_t, kScannerOutWords> scanner_out{};
  std::array<std::uint16_t, kScannerInWords> scanner_in{};
  std::array<std::uint16_t, kProcessWords> process_data{};
  alignas(4) std::array<std::uint16_t, regmap::kDiagnosticsWords> diagnostics{};
  // Only in a build with a manager.
  std::array<std::uint16_t, kStatusWords> status{};
  std::array<std::uint16_t, kServices.manager() ? 2 : 0> node_requests{};
  std::array<std::uint8_t, kServices.manager() ? kNetworkBytes : 0> network{};  ///< see Coprocessor
  const std::array<RegisterRange, 8> map;
};

template <std::size_t kNetworks = 1>
class Station {
 public:
  using Ports = std::array<CanPort*, kNetworks>;

  struct Settings {
    RtuServer::Settings modbus;
    std::array<Coprocessor::Settings, kNetworks> coprocessors;
    std::span<std::uint16_t> board =
        {};  ///< kBoardWords, the board's own settings; empty = no such registers
  };

  /// All outlive the station.
  Station(Hardware& hardware, const Ports& ports, const Settings& settings)
      : Station(hardware, ports, settings, std::make_index_sequence<kNetworks>()) {}

  RtuServer& modbus() { return modbus_; }
  Registers& registers(std::size_t network = 0) { return registers_[network]; }
  const Coprocessor& coprocessor(std::size_t network = 0) const { return coprocessors_[network]; }

  /// Call it before start(): see Coprocessor::keep_in().
  void keep_in(ParameterMemory& memory, std::size_t network = 0) { coprocessors_[network].keep_in(memory); }

  /// Sends the boot-up message of each network.
  void start() {
    for (Coprocessor& coprocessor : coprocessors_)
      coprocessor.start(hardware_.now());
  }

  /// Processes received frames, at most one Modbus request, and everything due. Returns the latest time of
  /// the next turn; kNever = only after an interrupt.
  Time turn() {
    const Time now = hardware_.now();
    Frame frame;
    for (std::size_t network = 0; network < kNetworks; ++network) {
      while (hardware_.receive(network, frame))
        coprocessors_[network].on_frame(frame, now);
      coprocessors_[network].on_bus_state(hardware_.bus_state(network), now);
    }
    const std::uint32_t silence = modbus_.poll(static_cast<std::uint32_t>(now));
    if (silence == 0) execute(now);
    Time due = silence == 0 || silence == RtuServer::kNoRequest ? kNever : now + silence;
    for (Coprocessor& coprocessor : coprocessors_)
      due = earlier(due, coprocessor.poll(now));
    return due;
  }

 private:
  template <std::size_t... kNetwork>
  Station(Hardware& hardware, const Ports& ports, const Settings& settings,
          std::index_sequence<kNetwork...> /*networks*/)
      : hardware_(hardware),
        registers_{Registers(settings.coprocessors[kNetwork], settings.board)...},
        maps_{RegisterMap(registers_[kNetwork].map)...},
        modbus_(maps_, settings.modbus),
        coprocessors_{Coprocessor(
            RegisterWindow(registers_[kNetwork].window), registers_[kNetwork].process_data, *ports[kNetwork],
            settings.coprocessors[kNetwork],
            ScannerWindow(registers_[kNetwork].scanner_out, registers_[kNetwork].scanner_in))...} {
    if constexpr (kServices.manager())
      for (std::size_t network = 0; network < kNetworks; ++network) {
        Registers& of = registers_[network];
        coprocessors_[network].use_network(of.network, 0);
        coprocessors_[network].show_status_in(of.status, of.node_requests);
      }
  }

  void execute(Time now) {
    const bool to_all = modbus_.is_broadcast();
    const std::size_t asked = kNetworks == 1 ? 0 : modbus_.request_network();
    // Diagnostics registers are updated only when a request reads them.
    if (modbus_.request_reads(regmap::kDiagnosticsFirst, regmap::kDiagnosticsWords))
      publish(registers_[asked].diagnostics, now, hardware_.health(asked), hardware_.bus_state(asked),
              modbus_.counters(), coprocessors_[asked].counters());
    if (const auto response = modbus_.execute(); !response.empty()) hardware_.respond(response);
    const auto& [exception, written, read] = modbus_.executed();
    if (exception != modbus::Exception::kNone) return;
    for (std::size_t network = 0; network < kNetworks; ++network) {
      if (!to_all && network != asked) continue;
      coprocessors_[network].on_plc(0, written.first, written.count, now);
      if (written.count != 0) coprocessors_[network].on_registers_written(written.first, written.count, now);
    }
  }

  Hardware& hardware_;
  std::array<Registers, kNetworks> registers_;
  std::array<RegisterMap, kNetworks> maps_;
  RtuServer modbus_;
  std::array<Coprocessor, kNetworks> coprocessors_;
};

}  // namespace cbcan::boards
