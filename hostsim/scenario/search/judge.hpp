// SPDX-License-Identifier: MIT
#pragma once

/// Watches a plant while a PLC's program, or a scenario, runs on it with faults, and says whether what
/// happened may happen. Besides the conditions of [explore] these rules always apply:
///
///   - A value that was read is one that the node had when the request came; a write with result 0 is in the
///   node.
///   - A node gets no more downloads of an object than the PLC has requested.
///   - A transaction ends within the timeout after each response, and the quarantine.
///   - The own node is not Operational after the PLC's timeout.
///   - A response that is wrong in a detectable way, such as a toggle bit, does not end in result 0.
///   - A node that has not responded in time gets no request until it has, or the same time has passed again.
///   - At the end, without faults, each node can be read.
///
/// Faults that change values beyond detection suspend the first two.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "journal/words.hpp"
#include "plant/control.hpp"
#include "scenario/search/moment.hpp"
#include "scenario/search/search_settings.hpp"
#include "scenario/search/values_seen.hpp"

namespace cbcan::search {

enum class Verdict : std::uint8_t {
  kDone,
  kGaveUp,  ///< knowingly, with exit code kGaveUpCode
  kBroken,  ///< a condition or a rule
  kLate,    ///< the same, but the fault acted after the program's last request
};
std::string_view name_of(Verdict verdict);

/// EX_TEMPFAIL of sysexits.h.
inline constexpr int kGaveUpCode = 75;

/// An object of a node: network, node ID, index, sub-index.
using Object = std::tuple<std::uint8_t, std::uint8_t, std::uint16_t, std::uint8_t>;

/// What a run without faults shows.
struct Record {
  struct Transaction {
    std::string text;                    ///< request and result
    std::string value;                   ///< hexadecimal
    std::vector<std::uint32_t> matches;  ///< matching frames of each variant up to its end
  };
  std::vector<Transaction> transactions;
  std::vector<std::uint32_t> matches;  ///< up to the end of the run
  std::set<Object> changing;           ///< not what was written right after a write
  std::set<Object> unrequested;        ///< downloaded by another than the PLC
  std::set<std::string> nodes;         ///< that the run spoke with
  std::set<std::string> readable;      ///< at the end
  std::vector<std::string> frames;     ///< all, with their times
  std::uint64_t requests = 0;          ///< of Modbus
  Time duration = 0;
};

struct Result {
  Verdict verdict = Verdict::kDone;
  std::string what;     ///< the condition or rule of a broken run
  std::string seen;     ///< what was instead
  std::string during;   ///< the transaction at that time, or the one before
  std::string request;  ///< the last Modbus request
  std::string said;     ///< the end of what the command has written to standard error; lines
  bool happened = false;
  std::vector<bool> reached;  ///< by condition
  std::string frames;         ///< the last ones, lines
  Time duration = 0;
};

/// What is wrong, in which transaction, what the command has said, and the last frames; lines.
std::string report(const Result& result);

class Judge final : private plant::Listener {
 public:
  struct Parts {
    plant::Control& control;
    const Settings& settings;
    std::vector<Variant> counted;  ///< variants whose matching frames are recorded
    bool values_may_differ;        ///< because of the faults
    bool must_survive;             ///< giving up is a failure
    const Record* baseline;        ///< what the run without faults showed; null in that run itself
    std::function<void(Time)> pass;
  };
  /// Make it before the plant starts. Throws base::UsageError, with file and line, for a condition.
  explicit Judge(Parts parts);

  /// Time has passed, or a request has been answered. False: the run ends.
  bool look();
  /// A scenario has failed: a report of lines.
  void fail(const std::string& report) { broken("the scenario passes", report); }
  /// The program has ended, with this code; nullopt = a scenario.
  Result end(std::optional<int> exit_code);
  const Record& record() const { return record_; }

 private:
  /// What the frames of a node show.
  struct Server {
    std::uint32_t responses = 0;
    Time booted = 0;      ///< its last boot-up message
    Time active = 0;      ///< the last frame of a transfer
    Time left_alone = 0;  ///< the client waits until then, as there was no response
    std::set<std::pair<std::uint16_t, std::uint8_t>>
        written;  ///< objects whose writes it has confirmed since `booted`
  };

  struct Held {
    std::unique_ptr<plant::Condition> condition;
    std::string text;
  };

  std::vector<Held> conditions(const std::vector<Line>& lines);
  void on_frame(std::size_t network, const Frame& frame, Time now) override;
  void check(std::vector<Held>& held, std::string_view name);
  void follow(const journal::Event& event);
  void follow_end(const journal::Event& ended);
  void check_value(const journal::Event& ended, const Object& object);
  std::uint8_t own_node(std::size_t network) const;
  void on_boot_up(std::uint8_t network, std::uint8_t node, Time now);
  void on_request(const Frame& frame, std::uint8_t network, std::uint8_t node, Server& server, Time now);
  void on_started(std::uint8_t network, std::uint8_t node);
  void check_downloads();
  void check_own_nodes();
  void check_limits();
  void check_nodes();
  void broken(std::string_view what, std::string seen);
  void find_counters();
  std::vector<std::uint32_t> matches() const;
  std::uint64_t requests() const;
  sim::Node* node_of(const Object& object);
  std::vector<std::uint8_t> value_of(const Object& object);

  Parts parts_;
  plant::Control& control_;
  journal::Journal& journal_;
  journal::Cursor cursor_;
  std::vector<Held> always_;
  std::vector<Held> done_;
  std::vector<Held> gave_up_;
  std::vector<Held> reached_;
  std::map<Object, ValuesSeen> read_;  ///< when a request for an upload came
  std::map<Object, int> downloads_;    ///< on the bus, less those that were requested
  std::map<std::pair<std::uint8_t, std::uint8_t>, Server> servers_;  ///< by network and node
  struct Open {
    std::uint32_t responses_before;
    bool must_fail = false;
  };
  std::map<std::uint32_t, Open> open_;  ///< transactions
  struct Seen {
    std::size_t network;
    Frame frame;
    Time at;
    std::string text() const;
  };
  std::deque<Seen> frames_;  ///< the last ones
  struct Counter {
    const sim::FaultSet* set;
    unsigned number;
  };
  std::vector<Counter> counters_;  ///< by counted variant; number 0 = it has none
  std::string during_;
  std::string request_;
  std::vector<Time> silent_since_;  ///< by network: the last request before a silence that has been judged
  bool has_ended_ = false;
  Time looked_at_ = 0;
  std::uint64_t requests_before_ = 0;  ///< looked_at_
  std::uint64_t requests_at_fault_ = ~std::uint64_t{0};
  Result result_;
  Record record_;
};

}  // namespace cbcan::search
