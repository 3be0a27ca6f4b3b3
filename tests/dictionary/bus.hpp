// SPDX-License-Identifier: MIT
#pragma once

/// A bus with one device, of any of the files; the suite compares what devices of different kinds do there.

#include <string>
#include <vector>

#include "dictionaries.hpp"

namespace cbcan::test {

using Frames = std::vector<std::string>;  ///< "605#4000100000000000"

class Bus {
 public:
  virtual ~Bus() noexcept(false) {}  // a simulated one checks at its end
  /// A new device of this file, with node ID 5; or the same one again, with what it has stored. Returns what
  /// it sends.
  virtual Frames power_on(std::size_t file) = 0;
  virtual Frames power_cycle() = 0;
  /// Sends a frame; returns all that the device has sent then.
  virtual Frames exchange(const std::string& frame) = 0;
  virtual Frames pass(Time duration) = 0;
};

}  // namespace cbcan::test
