// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor's SDO timeout (3003h) and transfer mode (3004h) for one transfer.

#include "cbcanctl/session.hpp"

namespace cbcan::ctl {

/// One object of the coprocessor that has another value for as long as this lives. A second Ctrl-C leaves it
/// as it is, and says so.
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

/// Sets what --timeout and --mode ask for, while `transfer` runs, and puts back what was there, whatever
/// happens. Other programs' transfers see it meanwhile.
tools::Bytes with_settings(window::Client& client, const Options& options,
                           const tools::Transaction& transfer);

}  // namespace cbcan::ctl
