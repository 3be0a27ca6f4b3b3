// SPDX-License-Identifier: MIT
#pragma once

/// The coprocessor's SDO timeout (3003h) and transfer mode (3004h) for one transfer.

#include <array>
#include <string_view>

#include "cbcanctl/session.hpp"

namespace cbcan::ctl {

/// Names of --mode; the place of each is its number in 3004h.
inline constexpr std::array<std::string_view, 4> kTransferModes{"auto", "expedited", "segmented", "block"};

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

tools::Bytes two_bytes(int number);

/// Sets what --timeout and --mode ask for, while `transfer` runs, and puts back what was there, whatever
/// happens. Other programs' transfers see it meanwhile.
tools::Bytes with_settings(window::Client& client, const Options& options,
                           const tools::Transaction& transfer);

}  // namespace cbcan::ctl
