// SPDX-License-Identifier: MIT
// Nodes that do not respond because they have no node ID yet: LSS finds them by their identity.
#include "cbcan/canopen/manager/manager.hpp"

namespace cbcan {

void Manager::look_for_unconfigured(std::uint8_t node) {
  if (lss_ != nullptr && objects_.number(object::kSlaveLss, node) != 0) absent_.insert(node);
}

void Manager::ask_lss(Joining step, Time now) {
  constexpr std::array kRequests{lss::kFastscan, lss::kFastscan, lss::kConfigureNodeId,
                                 lss::kStoreConfiguration, lss::kSwitchStateGlobal};
  step_ = step;
  LssMaster::Request request{kRequests[static_cast<std::size_t>(step)]};
  if (step == Joining::kSetNodeId) request.argument = joining_;
  for (std::uint8_t part = 0; step < Joining::kSetNodeId && part != request.identity.size(); ++part) {
    request.identity[part] =
        objects_.number(static_cast<std::uint16_t>(object::kExpectedVendor + part), joining_);
    if (request.identity[part] != 0) request.argument |= static_cast<std::uint8_t>(1u << part);
  }
  lss_->start(request, now);
}

/// When a request has ended. Without a response "store" and the switch follow too: the device may have taken
/// the node ID. It does not get one if the node is no longer absent_.
void Manager::serve_lss(Time now) {
  if (lss_ == nullptr || lss_->busy()) return;
  if (joining_ == 0) {
    if (now < lss_from_ || absent_.empty()) return;
    joining_ = joined_ = absent_.next(joined_);
    return ask_lss(Joining::kFind, now);
  }
  const bool done = lss_->answer().outcome == LssMaster::Outcome::kDone;
  const bool finds = step_ < Joining::kSetNodeId;
  if (finds && !done) return end_joining(false);
  if (step_ == Joining::kSwitch) return end_joining(true);
  auto next = static_cast<Joining>(static_cast<std::uint8_t>(step_) + 1);
  if (finds && lss_->answer().specific != 0) {
    nodes_[joining_].failure = {AbortCode::kNone, object::kIdentity, lss::kSerial + 1, kAlike};
    next = Joining::kSwitch;
  }
  ask_lss(absent_.has(joining_) ? next : Joining::kSwitch, now);
}

void Manager::end_joining(bool found) {
  const std::uint8_t node = std::exchange(joining_, std::uint8_t{0});
  Failure& failure = nodes_[node].failure;
  if (!found && failure.letter == kAlike) failure = kNoResponse;
  absent_.erase(node);
  application_.on_node(node);
}

}  // namespace cbcan
