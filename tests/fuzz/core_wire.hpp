// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/slave.hpp"
#include "fuzz/core_plc.hpp"

namespace cbcan::fuzz {

/// The CAN port of the core under test. Looks at every frame that leaves: whether the contract has it, and
/// whether the transaction that it belongs to may still send.
struct Wire final : CanPort {
  Wire(const Plc& plc, std::uint8_t own_node) : plc_(plc), own_node_(own_node) {}

  bool try_send(const Frame& frame) override;

  /// The server has ended the transfer itself, or is new born: no frame to it any more, also no abort.
  void server_knows() { open_ = false; }

  const Slave* own = nullptr;  ///< its objects say which frames are its own
  static constexpr unsigned kAlways = 255;
  unsigned refuse = 0;
  std::uint8_t mode = 0;        ///< 3004h when the transaction began
  std::vector<Frame> requests;  ///< frames to SDO servers, for those who answer them

 private:
  void check(const Frame& frame);
  void check_nmt(const Frame& frame);
  void check_request(const Frame& frame);
  void check_abort(const Frame& frame);
  void check_initiate(const Frame& frame);
  void check_error_control(const Frame& frame);
  void check_own(const Frame& frame) const;
  bool is_at(std::uint16_t index, std::uint8_t sub, const Frame& frame) const;
  Frame initiate(std::uint8_t how) const;
  bool is_last_word(const Frame& frame) const;

  const Plc& plc_;
  std::uint8_t own_node_;
  std::uint32_t transfer_id_ = 0;  ///< 600h + node of the last transfer that has begun on the bus
  std::uint32_t mux_ = 0;          ///< its bytes 1..3
  unsigned transfer_ = 0;          ///< its transaction's number
  unsigned command_ = 0;  ///< number of the last transaction that sent its NMT command or guarding request
  bool open_ = false;     ///< it may still send
};

}  // namespace cbcan::fuzz
