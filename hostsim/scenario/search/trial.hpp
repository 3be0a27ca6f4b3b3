// SPDX-License-Identifier: MIT
#pragma once

/// One run of a program or scenario: what runs, and what it has shown.

#include <cstdint>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "config/config.hpp"
#include "scenario/search/moment.hpp"

namespace cbcan::search {

enum class Verdict : std::uint8_t {
  kDone,
  kGaveUp,  ///< knowingly, with exit code kGaveUpCode
  kBroken,  ///< a condition or a rule
  kLate,    ///< the same, but the fault acted after the program's last request
};

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
  std::string disturbed;  ///< the Modbus request on which a fault of the PLC acted first
  std::string said;     ///< the end of what the command has written to standard error; lines
  bool happened = false;
  std::vector<bool> reached;  ///< by condition
  std::string frames;         ///< the last ones, lines
  Time duration = 0;
};

/// What a run with one fault has shown about a second one.
struct Near {
  std::string variants;                           ///< the moments' variants, as a hash
  std::vector<Record::Transaction> transactions;  ///< see Exploration::near()
};

/// What is wrong, in which transaction, what the command has said, and the last frames; lines.
std::string report(const Result& result);

/// One run of the program or scenario.
struct Trial {
  config::Config config;
  std::vector<Variant> counted = {};  ///< their matching frames are recorded
  bool values_may_differ = false;     ///< because of the faults
  bool must_survive = false;          ///< giving up is a failure
  bool faults_pass = true;            ///< they prevent nothing, or not for long
  const Record* baseline = nullptr;   ///< what the run without faults showed; null in that run itself
};

/// What a trial has shown.
struct TrialReport {
  Result result{};
  Record record{};
  std::string problem{};  ///< why it could not run; empty = it could
  bool is_usage = false;  ///< the problem is the user's, not the machine's
};

}  // namespace cbcan::search
