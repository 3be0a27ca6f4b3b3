// SPDX-License-Identifier: MIT
#pragma once

/// A job for each node of a network that applies its configuration, in the order of CiA 302's boot-up: check
/// the identity, write, read back, start.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cbcanctl/channels.hpp"
#include "descriptions/network_file.hpp"

namespace cbcan::tools {

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
