// SPDX-License-Identifier: MIT
#pragma once

/// Makes the events of one CAN network from its bus, module, nodes and PLC, and finds the transaction that each
/// belongs to. Time arguments are those of the world.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/canopen/manager/manager.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/regmap.hpp"
#include "descriptions/failures.hpp"
#include "journal/advice.hpp"
#include "journal/journal.hpp"
#include "protocols/modbus_server.hpp"
#include "sim/bus.hpp"
#include "sim/coprocessor_module.hpp"
#include "sim/faults/fault.hpp"

namespace cbcan::journal {

/// The message of a data frame of 8 bytes on an EMCY identifier of CiA 301; nullopt for any other frame.
std::optional<descriptions::EmergencyMessage> emergency_of(const Frame& frame);

/// The word at this place in a Modbus PDU, high byte first; 0 beyond its end.
std::uint32_t word_at(std::span<const std::uint8_t> pdu, std::size_t place);

class NetworkWatch final : public sim::Observer, public sim::ModuleWatch, public sim::FaultListener {
 public:
  NetworkWatch(Journal& journal, const Advisor::Network& network, std::span<const PlcWindow> windows);
  NetworkWatch(const NetworkWatch&) = delete;
  NetworkWatch& operator=(const NetworkWatch&) = delete;

  void on_bus_frame(const Frame& frame, Time now) override;
  void before(Time now) override;
  void after(Time now) override;
  void on_fault(std::string_view text, Time now) override;
  void on_node_state(std::uint8_t node, std::uint8_t state, Time now) override;
  void on_terminals(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::int32_t before,
                    std::int32_t after, Time now) override;
  /// Call it before the module handles the request.
  void on_modbus(const protocols::ModbusExchange& exchange, const modbus::Access& access, Time now);
  Advisor& advisor() { return advisor_; }

  /// Number and bits of all frames so far.
  std::uint64_t frames() const { return frames_; }
  std::uint64_t bits() const { return bits_; }
  /// When this node was last heard, since the plant's start; kNever = not yet.
  Time heard_at(std::uint8_t node) const { return nodes_[node].heard; }
  /// The last EMCY message of this node; all zeros without one.
  const Frame& last_emergency(std::uint8_t node) const { return nodes_[node].emergency; }
  /// Why the last boot of this node has failed, or it was lost; empty once it runs.
  const std::string& boot_failure(std::uint8_t node) const { return nodes_[node].failure_words; }

 private:
  struct Transaction {
    Event request;  ///< as it began
    bool open = false;
    bool sent = false;                ///< frames of it have been on the bus; of SDO transfers only
    std::vector<std::uint8_t> value;  ///< to be written
  };
  struct Watched {
    /// Whether there is a new request, or a result.
    bool has_moved() const {
      if (window.in.empty()) return (window.out[0] == regmap::kExecute) != transaction.open;
      return window.in[regmap::kScannerTaken] != taken ||
             (transaction.open && window.in[regmap::kScannerAnswered] == taken);
    }

    PlcWindow window;
    std::uint16_t taken = 0;  ///< last request number taken from the scanner window
    Transaction transaction{};
  };
  /// The SDO transfer with a node that was initiated last.
  struct Transfer {
    std::uint32_t transaction = 0;    ///< 0 = none of the PLC's
    std::uint32_t segments_from = 0;  ///< sdo::kRequestId or kResponseId: who sends segments of a block
    sdo::Multiplexer object = 0;
    Time ended = kNever;  ///< the transaction, since the plant's start
    bool failed = false;  ///< the same
    Frame response{};     ///< the last one
  };
  struct Node {
    Transfer transfer;
    bool is_simulated = false;
    std::uint8_t state = kOff;
    Time heard = kNever;
    Frame emergency{};
    std::uint8_t step = 0;                ///< of its boot
    descriptions::BootFailure failure{};  ///< the last one since it ran, without name and step
    std::string failure_words{};
  };

  Event event(Kind kind, Time now) const;
  void look_at(Watched& watched, Time now);
  void begin(Watched& watched, Time now);
  void end(Watched& watched, std::uint16_t result, Time now);
  Transaction* first_open(std::uint8_t node, auto fits);
  void begin_transfer(Transfer& transfer, std::uint8_t node, const Frame& request);
  std::uint32_t transfer_of(std::uint8_t node, const Frame& frame, Time at);
  std::uint32_t transaction_of(const Frame& frame, Time at);
  void look_at_boots(Time now);
  void on_step(std::uint8_t node, std::uint8_t before, Time now);
  descriptions::BootFailure failure_of(std::uint8_t node, char letter, std::uint8_t before,
                                       const Manager::Failure& failure) const;
  void note_state(std::uint8_t node, std::uint8_t state, Time now);

  Journal& journal_;
  Advisor::Network network_;
  std::vector<Watched> windows_;
  std::span<const std::uint16_t> status_;  ///< R3928..R4099; empty without a module
  std::uint16_t changes_ = 0;  ///< of status_, as seen
  std::array<Node, 128> nodes_{};
  Event command_{};  ///< the NMT transaction whose frame is not yet on the bus
  std::uint64_t frames_ = 0;
  std::uint64_t bits_ = 0;
  Advisor advisor_;
};

}  // namespace cbcan::journal
