// SPDX-License-Identifier: MIT
#pragma once

/// Mistakes of a PLC program, seen in its Modbus requests, their transactions and the bus. Changes neither
/// registers nor frames. Each sentence says what was seen, why it is wrong and what to do.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cbcan/frame.hpp"
#include "cbcan/mistakes.hpp"
#include "cbcan/modbus/executor.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"
#include "journal/journal.hpp"
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

/// Time arguments are those of the world.
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

}  // namespace cbcan::journal
