// SPDX-License-Identifier: MIT
#pragma once

/// Life guarding (CiA 301, 7.2.8.3.2.2): a guarded device notices that its NMT master has fallen silent.
/// Objects, if the dictionary has them: 100Ch guard time in ms, 100Dh life time factor; their product is the
/// life time, 0 = none.

#include <cstdint>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/part.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class LifeGuard : public Part {
 public:
  explicit LifeGuard(const ObjectDictionary& dictionary) : dictionary_(dictionary) {}

  static constexpr bool owns(std::uint16_t index) {
    return index == object::kGuardTime || index == object::kLifeTimeFactor;
  }
  /// The life time starts with the next request.
  void configure(std::uint16_t /*index*/, Time /*now*/) {
    life_time_ =
        dictionary_.get(object::kGuardTime, 0) * dictionary_.get(object::kLifeTimeFactor, 0) * kMillisecond;
    due_ = kNever;
    lost_ = false;
  }
  void reset(std::uint8_t node_id, Time now) {
    node_id_ = node_id;
    configure(object::kGuardTime, now);
  }
  /// True: the master asks for this node's state.
  bool on_frame(const Frame& frame, Time now) {
    if (frame.id != nmt::kErrorControlId + node_id_ || frame.flags != Frame::kRemote) return false;
    lost_ = false;
    due_ = life_time_ == 0 ? kNever : now + life_time_;
    return true;
  }
  void poll(Time now) {
    if (now < due_) return;
    due_ = kNever;
    lost_ = true;
  }
  Time deadline() const { return due_; }

  /// The life time has passed since the last request.
  bool lost() const { return lost_; }

 private:
  const ObjectDictionary& dictionary_;
  Time life_time_ = 0;
  Time due_ = kNever;
  std::uint8_t node_id_ = 0;
  bool lost_ = false;
};

}  // namespace cbcan
