// SPDX-License-Identifier: MIT
#pragma once

/// The planned configuration of nodes, and a job for each node that applies it, in the order of CiA 302's
/// boot-up: check the identity, write, read back, start.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cbcanctl/channels.hpp"
#include "cbcanctl/value.hpp"

namespace cbcan::tools {

inline constexpr std::uint16_t kDeviceType = 0x1000;
inline constexpr std::uint16_t kIdentity = 0x1018;

struct PlannedObject {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  Bytes value;
};

struct PlannedNode {
  std::uint8_t id = 0;
  std::vector<PlannedObject> identity;  ///< 1000h, 1018h: expected values
  std::vector<PlannedObject> objects;   ///< to write
};

/// A plan in TOML; `name` is the file's. Throws UsageError: "plan.toml:12: node 300: node IDs are 1..127".
std::vector<PlannedNode> parse_plan(std::string_view text, const std::string& name);

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
