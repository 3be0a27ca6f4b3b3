// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/slave.hpp"
#include "fuzz/core_plc.hpp"

namespace cbcan::fuzz {

inline constexpr std::uint8_t kAbort = 0x80;

inline std::uint32_t mux_of(const Frame& frame) {
  return frame.data[1] | std::uint32_t{frame.data[2]} << 8 | std::uint32_t{frame.data[3]} << 16;
}

/// CAN-IDs that no configurable message may use (CiA 301, 7.3.5).
inline bool is_restricted(std::uint32_t id) {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) ||
         (id >= 0x601 && id <= 0x67F) || (id >= 0x6E0 && id <= 0x6FF) || id >= 0x701;
}

inline std::uint8_t nmt_specifier(std::uint16_t code) {
  switch (code) {
    case 5:
    case 1: return 0x01;
    case 4:
    case 2: return 0x02;
    case 127:
    case 128: return 0x80;
    case 6:
    case 129: return 0x81;
    default: return 0x82;
  }
}

/// The CAN port of the core under test. Checks every sent frame: whether the contract allows it, and whether its
/// transaction may still send.
struct Wire final : CanPort {
  Wire(const Plc& plc, std::uint8_t own_node) : plc_(plc), own_node_(own_node) {}

  bool try_send(const Frame& frame) override {
    if (refuse != 0) {
      if (refuse != kAlways) --refuse;
      return false;
    }
    check(frame);
    return true;
  }

  /// The server has ended the transfer itself, or has booted: no more frames to it, not even an abort.
  void server_knows() { open_ = false; }

  const Slave* own = nullptr;  ///< its objects define its own frames
  static constexpr unsigned kAlways = 255;
  unsigned refuse = 0;
  std::uint8_t mode = 0;        ///< 3004h when the transaction began
  std::vector<Frame> requests;  ///< frames to SDO servers, to be answered

 private:
  void check(const Frame& frame) {
    const bool remote = frame.flags == Frame::kRemote;
    require(frame.length <= 8 && (frame.flags == 0 || remote), "frames are classical, with 11 bits");
    const std::uint32_t node = frame.id & 0x7F;
    require(!remote || (frame.id >> 7 == 0xE && node != own_node_),
            "only a guarding request is a remote frame");
    if (frame.id == 0) return check_nmt(frame);
    if (frame.id >> 7 == 0xE && node != 0) return check_error_control(frame);
    if (frame.id >> 7 == 0xC && node != 0) return check_request(frame);
    if (frame.id == 0x580u + own_node_) return require(frame.length == 8, "an SDO response has eight bytes");
    check_own(frame);
  }
  void check_nmt(const Frame& frame) {
    if (plc_.shared) return require(frame.length == 2, "an NMT command has two bytes");
    const Plc::Request& request = plc_.request();
    require(plc_.busy() && request.kind == Plc::Kind::kNmt, "an NMT command was asked for");
    require(command_ != plc_.number(), "one NMT command for one transaction");
    command_ = plc_.number();
    require(frame.length == 2 && frame.data[0] == nmt_specifier(request.data[0]),
            "the NMT service asked for");
    require(frame.data[1] == (request.sub == 128 ? 0 : request.sub),
            "the NMT command goes to the node asked for");
  }
  void check_request(const Frame& frame) {
    require(frame.length == 8, "an SDO request has eight bytes");
    requests.push_back(frame);
    if (plc_.shared) return;
    if (frame.data[0] == kAbort) return check_abort(frame);
    if (is_last_word(frame)) return;
    require(plc_.busy() && plc_.request().kind == Plc::Kind::kSdo, "no request without a transaction");
    if (transfer_ != plc_.number()) return check_initiate(frame);
    require(open_ && frame.id == transfer_id_, "no frame after the end of its transfer");
  }
  void check_abort(const Frame& frame) {
    require(open_ && frame.id == transfer_id_, "one abort at most, to a server that waits");
    require(mux_of(frame) == mux_, "an abort has the multiplexer of its transfer");
    open_ = false;
  }
  void check_initiate(const Frame& frame) {
    const bool may_choose_block = mode == 0 && plc_.request().size > 28;
    require(frame == initiate(mode) || (may_choose_block && frame == initiate(3)),
            "a transfer begins as CiA 301 has it");
    transfer_ = plc_.number();
    transfer_id_ = frame.id;
    mux_ = mux_of(frame);
    open_ = true;
  }
  void check_error_control(const Frame& frame) {
    require(frame.length == 1, "an error control frame has one byte");
    if ((frame.id & 0x7F) == own_node_) return;
    if (plc_.shared) return require(frame.flags == Frame::kRemote, "nobody speaks for another node");
    const Plc::Request& request = plc_.request();
    require(frame.flags == Frame::kRemote, "nobody speaks for another node");
    require(plc_.busy() && request.kind == Plc::Kind::kNodeState, "a guarding request was asked for");
    require((frame.id & 0x7F) == request.node && command_ != plc_.number(),
            "one guarding request, to that node");
    command_ = plc_.number();
  }
  /// SYNC, TIME, EMCY and PDOs of the own node.
  void check_own(const Frame& frame) const {
    require(!is_restricted(frame.id), "what can be configured keeps clear of the restricted CAN-IDs");
    const bool counted = own->dictionary().get(0x1019, 0) != 0;
    if (is_at(0x1005, 0, frame) && frame.length == (counted ? 1 : 0)) return;
    if (is_at(0x1012, 0, frame) && frame.length == 6) return;
    if (is_at(0x1014, 0, frame) && frame.length == 8) return;
    bool is_pdo = false;
    for (std::uint16_t index = 0x1800; index < 0x1810; ++index)
      is_pdo = is_pdo || (is_at(index, 1, frame) && frame.length != 0);
    require(is_pdo && own->state() == nmt::State::kOperational,
            "nothing else than TPDOs in Operational is left");
  }
  /// The frame has the CAN-ID in this object, whose message exists.
  bool is_at(std::uint16_t index, std::uint8_t sub, const Frame& frame) const {
    const auto cob_id = static_cast<std::uint32_t>(own->dictionary().get(index, sub));
    const bool exists = index == 0x1005 || index == 0x1012 || (cob_id & 0x80000000) == 0;
    return exists && (cob_id & 0x7FF) == frame.id;
  }
  Frame initiate(std::uint8_t how) const {
    const Plc::Request& request = plc_.request();
    Frame frame;
    frame.id = 0x600u + request.node;
    frame.length = 8;
    const auto low = static_cast<std::uint8_t>(request.index);
    const auto size = static_cast<std::uint8_t>(request.size);
    frame.data = {0x40, low, static_cast<std::uint8_t>(request.index >> 8),
                  static_cast<std::uint8_t>(request.sub)};
    if (request.is_read()) {
      if (how == 3) frame.data[0] = 0xA4;
      if (how == 3) frame.data[4] = static_cast<std::uint8_t>((request.size + 6) / 7);
    } else if (how == 3 || how == 2 || size > 4) {
      frame.data[0] = how == 3 ? 0xC6 : 0x21;
      frame.data[4] = size;
    } else {
      frame.data[0] = static_cast<std::uint8_t>(0x23 | (4 - size) << 2);
      for (std::size_t i = 0; i < size; ++i)
        frame.data[4 + i] = request.byte(i);
    }
    return frame;
  }
  /// The last frame of a block read; the port may have refused it for a while.
  bool is_last_word(const Frame& frame) const {
    const bool over = !plc_.busy() || transfer_ != plc_.number();
    return over && open_ && frame.data[0] == 0xA1 && frame.id == transfer_id_;
  }

  const Plc& plc_;
  std::uint8_t own_node_;
  std::uint32_t transfer_id_ = 0;  ///< 600h + node of the last transfer that has begun on the bus
  std::uint32_t mux_ = 0;          ///< its bytes 1..3
  unsigned transfer_ = 0;          ///< its transaction's number
  unsigned command_ = 0;  ///< number of the last transaction that sent its NMT command or guarding request
  bool open_ = false;     ///< it may still send
};

}  // namespace cbcan::fuzz
