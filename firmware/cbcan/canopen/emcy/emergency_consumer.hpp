// SPDX-License-Identifier: MIT
#pragma once

/// EMCY consumer for all nodes (CiA 301, 7.2.7), with the scan of CiA 405's RECV_EMCY. A message costs one
/// copy of eight bytes; a step of the scan reads four words, whatever the number of nodes. Nothing is
/// allocated; not re-entrant.

#include <array>
#include <cstdint>

#include "cbcan/canopen/built_if.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/nmt/node_set.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/frame.hpp"

namespace cbcan {

class EmergencyConsumer {
 public:
  /// Bytes as on the bus: error code, low byte first; error register (1001h); five bytes of the manufacturer.
  using Message = std::array<std::uint8_t, 8>;

  static constexpr std::uint32_t kFirstId = 0x080;  ///< + node ID
  static constexpr std::uint32_t kLastId = kFirstId + nmt::kMaxNode;

  /// A data frame on 081h..0FFh; ignored if it has less than eight bytes.
  void on_frame(const Frame& frame) {
    if (frame.length == frame.data.size())
      note(static_cast<std::uint8_t>(frame.id & nmt::kMaxNode), frame.data);
  }

  /// Node 1..127 has sent this message.
  void note(std::uint8_t node, const Message& message) {
    if (is_error(message) || is_error(last_[node])) stops_.insert(node);
    last_[node] = message;
  }

  /// The last message of a node; zeros = none.
  const Message& last(std::uint8_t node) const { return last_[node]; }

  /// The next node, after the one returned last, whose last message is an error, or (once) is No Error (code
  /// 0000h) after an error. 0 = no such node.
  std::uint8_t scan() {
    const std::uint8_t node = stops_.next(stopped_at_);
    if (node == 0) return 0;
    stopped_at_ = node;
    if (!is_error(last_[node])) stops_.erase(node);
    return node;
  }

  static bool is_error(const Message& message) { return message[0] != 0 || message[1] != 0; }

  void reset() {
    last_.fill({});
    stops_.clear();
    stopped_at_ = 0;
  }

 private:
  std::array<Message, nmt::kMaxNode + 1> last_{};
  NodeSet stops_;
  std::uint8_t stopped_at_ = 0;
};

using Emergencies = BuiltIf<kServices.emergencies, EmergencyConsumer>;

}  // namespace cbcan
