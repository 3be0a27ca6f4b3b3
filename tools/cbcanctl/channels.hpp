// SPDX-License-Identifier: MIT
#pragma once

/// Many nodes at once: each channel of the module (docs/reference/contract.md, "Channels") carries out one
/// job after the other. Independent of Modbus: RegisterAccess reads and writes the registers.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cbcan/regmap.hpp"
#include "cbcan/window.hpp"
#include "descriptions/network_file.hpp"
#include "descriptions/values.hpp"

namespace cbcan::tools {

using namespace descriptions;

using window::sdo_read, window::sdo_write, window::Transaction;

/// The module's registers; each call is one Modbus request.
class RegisterAccess {
 public:
  virtual ~RegisterAccess() = default;
  virtual window::Response exchange(const window::Request& request) = 0;
  /// Called when no channel has a result: lets time pass. May throw, to cancel.
  virtual void wait() = 0;
  /// Reports the number of ended jobs.
  virtual void progress(std::size_t /*ended*/) {}
};

/// Transactions, carried out one after the other.
class Job {
 public:
  virtual ~Job() = default;
  /// None = no more transactions.
  virtual std::optional<Transaction> next() = 0;
  virtual void ended(const window::Result& result) = 0;
};

struct ObjectPlace {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
};

/// Reads objects of one node; stops if it does not respond to the first read.
class ReadJob final : public Job {
 public:
  ReadJob(std::uint16_t node, std::vector<ObjectPlace> places) : node_(node), places_(std::move(places)) {}

  std::optional<Transaction> next() override;
  void ended(const window::Result& result) override { results_.push_back(result); }

  std::uint16_t node() const { return node_; }
  bool silent() const;
  const std::vector<window::Result>& results() const { return results_; }

 private:
  std::uint16_t node_;
  std::vector<ObjectPlace> places_;
  std::vector<window::Result> results_;
};

/// Carries out all jobs on those of the channels 16 to 2 that exist; returns when the last job has ended.
/// False: the module has only channel 1, and nothing was done. Other programs must not use these channels
/// meanwhile. `sdo_timeout_ms`: 3003h of these channels during the call, also if it throws; 0 = unchanged.
bool run(RegisterAccess& registers, std::span<Job* const> jobs, std::uint16_t sdo_timeout_ms = 0);

/// A job for each node of a network that applies its configuration, in the order of CiA 302's boot-up: check
/// the identity, write, read back, start.
class NodeConfiguration final : public Job {
 public:
  /// `verify`: reads back each value; a write-only object counts as written. A read-only object must have the
  /// value already.
  NodeConfiguration(const PlannedNode& node, bool verify);

  std::optional<Transaction> next() override;
  void ended(const window::Result& response) override;

  const PlannedNode& node() const { return node_; }
  /// Why the node was not started; empty = it was.
  const std::string& problem() const { return problem_; }
  /// The response that caused this, unless a different value did.
  const std::optional<window::Result>& refusal() const { return refusal_; }

 private:
  enum class Kind : std::uint8_t { kCheck, kWrite, kReadBack, kStart };
  struct Step {
    Kind kind;
    const PlannedObject* object;
  };

  const PlannedNode& node_;
  std::vector<Step> steps_;
  std::size_t at_ = 0;
  std::string problem_;
  std::optional<window::Result> refusal_;
};

}  // namespace cbcan::tools
