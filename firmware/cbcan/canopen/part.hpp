// SPDX-License-Identifier: MIT
#pragma once

/// A service of a Device other than NMT, SDO and error control: SYNC, TIME, EMCY, heartbeat consumer, life
/// guarding, process data. A part knows the dictionary and a port but no other part; Device passes on what
/// concerns another part. All parts have these functions and hide the ones that they implement; none is
/// virtual. To add a part: derive it from Part, and add it to Device::with_parts() and poll().

#include <cstdint>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/sdo/abort_code.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class Part {
 public:
  bool operator==(const Part&) const = default;

  /// The objects that configure it.
  static constexpr bool owns(std::uint16_t /*index*/) { return false; }

  /// Called before a number is stored in such an object: kNone, or the reason why it cannot be.
  AbortCode check(std::uint16_t /*index*/, std::uint8_t /*sub*/, std::uint32_t /*number*/) const {
    return AbortCode::kNone;
  }
  /// Called after one has been stored.
  void configure(std::uint16_t /*index*/, Time /*now*/) {}
  /// The dictionary's values have been restored; on_state() follows.
  void reset(std::uint8_t /*node_id*/, Time /*now*/) {}
  /// This NMT state has been entered, or entered again.
  void on_state(nmt::State /*state*/, Time /*now*/) {}

  /// Frames with this CAN-ID go to on_frame() before they are checked for process data.
  bool hears(std::uint32_t /*id*/) const { return false; }
  /// A frame from the bus. True: it is for this part and no other.
  bool on_frame(const Frame& /*frame*/, Time /*now*/) { return false; }
  /// Does what is due. Call it at deadline() at the latest; more often is harmless.
  void poll(Time /*now*/) {}
  Time deadline() const { return kNever; }

  /// Calls visit(id) for each CAN-ID that it must receive; for some perhaps twice.
  void visit_ids(auto /*visit*/) const {}
};

}  // namespace cbcan
