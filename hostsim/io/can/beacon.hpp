// SPDX-License-Identifier: MIT
#pragma once

/// Tells a network where a socketcand is: a datagram every 3 s, by which SavvyCAN and Kayak find servers and
/// python-can lists them. socketcand's doc/protocol.md, "Service discovery".

#include <cstdint>
#include <string>

#include "cbcan/time.hpp"
#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"
#include "io/sockets/listen_address.hpp"

namespace cbcan::io {

class Beacon {
 public:
  /// `to`: mostly a broadcast address. `server`: whose clients are meant; where that is any address of this
  /// machine (0.0.0.0), they are told the one by which the kernel reaches `to`. Throws EnvironmentError.
  Beacon(const text::ListenAddress& to, const text::ListenAddress& server, Warn warn);

  /// Sends what is due; where that fails it says so once, and tries again.
  void poll(Time now);
  Time next_deadline() const { return next_; }

 private:
  Descriptor socket_;
  std::string where_;
  std::string text_;
  Warn warn_;
  Time next_ = 0;
  bool failed_ = false;
};

}  // namespace cbcan::io
