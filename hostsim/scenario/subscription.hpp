// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scenario/control.hpp"

namespace cbcan::scenario {

/// What can be told of: "frames", "emcy", "transactions".
std::span<const std::string_view> event_kinds();

/// Tells of what happens, a line each, until it goes.
class Subscription final : public Listener {
 public:
  using Sink = std::function<void(std::string_view lines)>;

  /// `kinds`: names of event_kinds(); none are all.
  Subscription(Control& control, const Words& kinds, Sink sink);
  ~Subscription();
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;

  void on_frame(std::size_t network, const Frame& frame, Time now) override;
  /// Transactions may have begun or ended.
  void look();

 private:
  struct Known {
    std::uint32_t begun;
    bool under_way;
  };
  void tell(std::string_view what) const;
  Known known(std::size_t network) const;
  bool wants(std::string_view kind) const;

  Control& control_;
  std::vector<std::string> kinds_;
  Sink sink_;
  std::vector<Known> known_;  ///< by network
};

}  // namespace cbcan::scenario
