// SPDX-License-Identifier: MIT
#pragma once

/// What a Device has besides NMT, SDO and error control: SYNC, TIME, EMCY, heartbeat consumer, life guarding,
/// process data. A part knows the dictionary and a port and none of the others; Device passes on what happens
/// in one and concerns another. All parts have this shape, and hide here what they do something about; it is
/// not virtual. To add a part: give it this shape, and a place in Device::with_parts() and poll().

#include <cstdint>
#include <span>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/sdo/abort_code.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class Part {
 public:
  /// What begins anew.
  struct Reset {
    std::uint8_t node_id;
    bool application;  ///< power-on or reset node; false: the communication alone
  };

  /// The objects that configure it.
  static constexpr bool owns(std::uint16_t /*index*/) { return false; }

  /// Before a number is stored in such an object: kNone, or why it cannot be.
  AbortCode check(std::uint16_t /*index*/, std::uint8_t /*sub*/, std::uint32_t /*number*/) const {
    return AbortCode::kNone;
  }
  /// After one has been stored.
  void configure(std::uint16_t /*index*/, Time /*now*/) {}
  /// The dictionary's values have been restored; on_state() follows.
  void reset(const Reset& /*reset*/, Time /*now*/) {}
  /// This NMT state has been entered, perhaps anew.
  void on_state(nmt::State /*state*/, Time /*now*/) {}

  /// Frames with this CAN-ID are for on_frame() before they may be process data.
  bool hears(std::uint32_t /*id*/) const { return false; }
  /// A frame from the bus. True: it is this part's, and of no interest to the others.
  bool on_frame(const Frame& /*frame*/, Time /*now*/) { return false; }
  /// Does what is due. To be called at deadline() at the latest; more often is harmless.
  void poll(Time /*now*/) {}
  Time deadline() const { return kNever; }

  /// Calls visit(id) for each CAN-ID that it wants to hear; for some perhaps twice.
  template <class Visitor>
  void visit_ids(Visitor /*visit*/) const {}
};

}  // namespace cbcan
