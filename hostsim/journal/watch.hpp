// SPDX-License-Identifier: MIT
#pragma once

/// Makes the events of one CAN network: hears bus, module, nodes and the PLC, and knows which transaction
/// what belongs to. Times that it is told are those of the world.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "adapters/modbus_unit.hpp"
#include "cbcan/regmap.hpp"
#include "journal/journal.hpp"
#include "sim/bus.hpp"
#include "sim/coprocessor_module.hpp"
#include "sim/faults/fault_set.hpp"

namespace cbcan::journal {

/// An EMCY message: a data frame of 8 bytes on the identifier that CiA 301 gives it.
struct Emergency {
  std::uint8_t node;
  std::uint16_t code;
};
std::optional<Emergency> emergency_of(const Frame& frame);

class NetworkWatch final : public sim::Observer, public sim::ModuleWatch, public sim::FaultListener {
 public:
  /// Where the PLC asks and where it is answered; `in` empty: the window of R3700, which is the first one.
  /// Both outlive this.
  struct Window {
    std::uint16_t first;  ///< register of out[0]
    std::span<const std::uint16_t> out;
    std::span<const std::uint16_t> in;
  };

  /// `started`: what is time 0 to the journal.
  NetworkWatch(Journal& journal, std::uint8_t network, std::span<const Window> windows, Time started);
  NetworkWatch(const NetworkWatch&) = delete;
  NetworkWatch& operator=(const NetworkWatch&) = delete;

  void on_bus_frame(const Frame& frame, Time now) override;
  void before(Time now) override;
  void after(Time now) override;
  void on_fault(std::string_view text, Time now) override;
  void on_node_state(std::uint8_t node, std::uint8_t state, Time now) override;
  void on_terminals(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::int32_t before,
                    std::int32_t after, Time now) override;
  /// Before the module hears of it.
  void on_modbus(const adapters::ModbusExchange& exchange, Time now);

  /// Of all frames so far.
  std::uint64_t frames() const { return frames_; }
  std::uint64_t bits() const { return bits_; }
  /// Of this node: since the plant's start; kNever = nothing has come yet.
  Time heard_at(std::uint8_t node) const { return nodes_[node].heard; }
  /// Its last EMCY message, all zeros without one.
  const Frame& last_emergency(std::uint8_t node) const { return nodes_[node].emergency; }

 private:
  struct Transaction {
    Event request;  ///< as it was begun
    Time begun = 0;
    bool open = false;
    std::array<std::uint8_t, regmap::kMaxDataBytes> value{};  ///< that it writes
    std::size_t size = 0;
  };
  struct Watched {
    /// Whether the PLC has another request there than the last one, or a result has come.
    bool has_moved() const {
      if (window.in.empty()) return (window.out[0] == regmap::kExecute) != transaction.open;
      return window.in[regmap::kScannerTaken] != taken ||
             (transaction.open && window.in[regmap::kScannerAnswered] == taken);
    }

    Window window;
    std::uint16_t taken = 0;  ///< number of the scanner window
    Transaction transaction{};
  };
  /// Requests to a node that wait for each other's ends: transfers, or asking for its state.
  struct Line {
    std::uint32_t transaction = 0;  ///< whose turn it is, or was last
    bool open = false;
    bool failed = false;  ///< that one: a late response, or the abort, may come
  };
  struct Node {
    Line transfers;
    Line states;
    bool is_simulated = false;
    std::uint8_t state = kOff;
    Time heard = kNever;
    Frame emergency{};
  };

  Event event(Kind kind, Time now) const;
  void look_at(Watched& watched, Time now);
  void begin(Watched& watched, Time now);
  void end(Watched& watched, std::uint16_t result, Time now);
  Line& line_of(const Event& request);
  std::uint32_t open_transaction(std::uint8_t node, Service service);
  std::uint32_t transaction_of(const Frame& frame);
  void note_state(std::uint8_t node, std::uint8_t state, Time now);

  Journal& journal_;
  std::uint8_t network_;
  Time started_;
  std::vector<Watched> windows_;
  std::array<Node, 128> nodes_{};
  Event command_{};  ///< the NMT transaction whose frame has not been on the bus yet
  std::uint64_t frames_ = 0;
  std::uint64_t bits_ = 0;
};

}  // namespace cbcan::journal
