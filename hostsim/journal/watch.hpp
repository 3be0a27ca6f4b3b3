// SPDX-License-Identifier: MIT
#pragma once

/// What observes a CAN network: makes its events, and finds mistakes of the PLC's program in them.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/canopen/manager/manager.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/mistakes.hpp"
#include "cbcan/modbus/executor.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"
#include "descriptions/failures.hpp"
#include "journal/journal.hpp"
#include "protocols/modbus_server.hpp"
#include "sim/bus.hpp"
#include "sim/coprocessor_module.hpp"
#include "sim/faults/fault.hpp"
#include "sim/world.hpp"

namespace cbcan::journal {

/// Bits of MISTAKES, with names and meanings in regmap::kMistakes.
enum class Mistake : std::uint8_t {
  kBusy,
  kFlagFirst,
  kAddress,
  kDecimal,
  kHexadecimal,
  kUnread,
  kSize,
  kUnit,
  kInputs,
  kNotStarted,
  kAllNodes,
  kNotHeard,
  kNumber,
  kTwoWriters,
  kTimeout,
  kStatusword,
};
constexpr std::string_view name_of(Mistake mistake) {
  return regmap::kMistakes[static_cast<std::size_t>(mistake)].name;
}

/// A mistake of one client. It becomes an event when it is seen first, and again after ten seconds without
/// it.
struct Advice {
  Mistake mistake;
  std::uint32_t client;  ///< as in events
  std::uint32_t count = 0;
  Time last = 0;             ///< since the plant's start
  std::uint64_t number = 0;  ///< of the latest event
  Event event{};             ///< the latest
  std::string words{};       ///< of the latest event
};

/// Where the PLC writes requests and reads results. The first window is that of R3700, with `in` empty. The
/// registers outlive their users.
struct PlcWindow {
  std::uint16_t first;  ///< register of out[0]
  std::span<const std::uint16_t> out;
  std::span<const std::uint16_t> in;
};

/// Mistakes of a PLC program, seen in its Modbus requests, their transactions and the bus. Changes neither
/// registers nor frames. Each sentence says what was seen, why it is wrong and what to do. Time
/// arguments are those of the world.
class Advisor {
 public:
  /// What it looks at; all of it outlives it.
  struct Network {
    std::uint8_t number;
    sim::World& world;
    const sim::CoprocessorModule* module;  ///< null = none
    std::span<const std::uint16_t> registers;
    std::uint16_t process_first;
    std::uint16_t status_first;
    Time started;  ///< time 0 of the journal
  };

  Advisor(Journal& journal, const Network& network, std::span<const PlcWindow> windows);

  /// A request has changed the registers, and the module has not handled it.
  void on_modbus(std::uint32_t client, const modbus::Access& access, Time now);
  /// The module has handled it.
  void on_handled() { client_.reset(); }
  /// A request to a unit ID that selects nothing.
  void on_other_unit(std::uint32_t client, std::uint8_t unit, Time now);
  /// A client writes to the scanner window of this channel after a newer one.
  void on_second_writer(unsigned channel, std::uint32_t client, std::uint32_t newer, Time now);
  void on_begun(const Event& begun);
  /// What the watch knows about the node of a transaction.
  struct Seen {
    bool heard;         ///< it has been on the bus
    bool others_first;  ///< its transfer before has not ended, or has failed
  };
  void on_ended(const Event& ended, const Seen& seen);
  void on_frame(const Frame& frame);

  /// All mistakes so far. `has_ended`: the program will not write again, so what it has begun was all of it.
  const std::vector<Advice>& all(Time now, bool has_ended);

 private:
  static constexpr std::size_t kWords = regmap::kWindowWords;
  static constexpr std::uint32_t kNoClient =
      ~std::uint32_t{0};  ///< a command, or a PLC that owns the registers

  struct Program {
    void take_words() { std::copy_n(window.out.data(), kWords, words.data()); }
    /// Whether the words of a request are those of the last one.
    bool repeats() const;
    std::uint16_t word(std::uint16_t address) const { return words[address - regmap::kWindowFirst]; }
    modbus::Range range() const { return {window.first, kWords}; }
    /// "R505" for R3705
    std::string name_of(std::uint16_t address) const {
      return "R" + std::to_string(window.first + address - regmap::kWindowFirst);
    }

    PlcWindow window;
    std::array<std::uint16_t, kWords> words{};  ///< of the last request
    Event request{};                            ///< as it began
    std::uint32_t client = kNoClient;           ///< that wrote it
    bool is_open = false;
    bool is_flag_first = false;   ///< the last request was CA0Eh alone
    bool was_ready = false;       ///< its drive, before this command, so 06h changes nothing
    std::string unread{};         ///< the last result, if it is a failure that no client has read
    Time renumbered_at = kNever;  ///< since when the OUT words are others under a finished request's number
  };
  /// Commands of a drive on the way to Operation enabled.
  struct Enabling {
    std::uint8_t node;
    std::uint16_t index;  ///< of the controlword
    bool is_shown;        ///< its statusword, since the last command
    bool has_missed;      ///< a command without a look before it
  };
  struct StateRequest {
    std::uint32_t client;
    Event request;
    Time at;
    bool is_unknown;   ///< there is no such node
    bool is_scanning;  ///< the one before was for the node ID before or after
  };

  void advise(Mistake mistake, std::uint32_t client, const Event& about, std::string words);
  void advise(Mistake mistake, const Program& program, std::string words);
  void look_at_addresses(const modbus::Range& written);
  void look_at_process_data(const modbus::Range& written);
  void look_at_request(const modbus::Range& written);
  void look_at_number(Program& program, Time patience);
  void look_at_outputs();
  void look_at_state_request();
  void look_at_object(const Program& program, std::uint32_t abort);
  void look_at_controlword(const Program& program);
  bool shows_statusword(const Frame& frame, const Enabling& drive) const;
  const ObjectDictionary* dictionary_of(std::uint8_t id) const;

  Journal& journal_;
  Network network_;
  std::vector<Program> programs_;
  std::optional<std::uint32_t> client_;  ///< whose request is handled now
  Time now_ = 0;
  Time outputs_at_ = kNever;  ///< first write of outputs while the own node is not Operational
  std::uint32_t outputs_client_ = 0;
  bool was_started_ = false;  ///< outputs are sent, or have been
  std::optional<StateRequest> asked_;
  Time no_object_at_ = kNever;  ///< the last abort 0602 0000h of an index that means nothing in decimal
  std::vector<Enabling> enabling_;
  std::vector<Advice> all_;
};

/// The message of a data frame of 8 bytes on an EMCY identifier of CiA 301; nullopt for any other frame.
std::optional<descriptions::EmergencyMessage> emergency_of(const Frame& frame);

/// The word at this place in a Modbus PDU, high byte first; 0 beyond its end.
std::uint32_t word_at(std::span<const std::uint8_t> pdu, std::size_t place);

/// Makes the events of one CAN network from its bus, module, nodes and PLC, and finds the transaction that
/// each belongs to. Time arguments are those of the world.
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
