// SPDX-License-Identifier: MIT
#pragma once

/// Life guarding (CiA 301, 7.2.8.3.2.2): a guarded device notices that its NMT master has fallen silent.
/// Objects, where the dictionary has them: 100Ch guard time in ms, 100Dh life time factor; their product is
/// the life time, 0 = none.

#include <cstdint>

#include "canopen/dictionary/object_dictionary.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class LifeGuard {
 public:
  static constexpr std::uint16_t kGuardTime = 0x100C;
  static constexpr std::uint16_t kLifeTimeFactor = 0x100D;

  explicit LifeGuard(const ObjectDictionary& dictionary) : dictionary_(dictionary) {}

  /// Takes over the life time; it counts from the next request on.
  void configure() {
    life_time_ = dictionary_.get(kGuardTime, 0) * dictionary_.get(kLifeTimeFactor, 0) * kMillisecond;
    due_ = kNever;
    lost_ = false;
  }

  /// The master has asked for this node's state.
  void on_request(Time now) {
    lost_ = false;
    due_ = life_time_ == 0 ? kNever : now + life_time_;
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
  bool lost_ = false;
};

}  // namespace cbcan
