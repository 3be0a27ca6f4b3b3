// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor's SDO timeout (3003h) and transfer mode (3004h) for one transfer.

#include "cbcanctl/session.hpp"

namespace cbcan::ctl {

/// Changes an object of the coprocessor during its lifetime. A second Ctrl-C prevents the restoring, with a
/// message.
class Borrowed {
 public:
  Borrowed(window::Client& client, std::uint16_t index, const tools::Bytes& value);
  ~Borrowed() { put_back(); }
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;

 private:
  void put_back() noexcept;

  window::Client& client_;
  std::uint16_t index_;
  tools::Bytes before_;
  bool changed_ = false;
};

/// Applies --timeout and --mode while `transfer` runs, and always restores the previous values. Meanwhile
/// they also apply to other programs' transfers.
tools::Bytes with_settings(window::Client& client, const Options& options,
                           const tools::Transaction& transfer);

}  // namespace cbcan::ctl
