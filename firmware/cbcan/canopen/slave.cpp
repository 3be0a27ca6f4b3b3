// SPDX-License-Identifier: MIT
#include "cbcan/canopen/slave.hpp"

namespace cbcan {

namespace {

// Bits of wanted_, in the order in which they are sent.
constexpr std::uint8_t kBootUp = 1;
constexpr std::uint8_t kGuardResponse = 2;
constexpr std::uint8_t kHeartbeat = 4;

}  // namespace

Slave::Slave(std::uint8_t node_id, const Tables& tables, std::span<std::uint8_t> buffer,
             Application& application, CanPort& port)
    : node_id_(node_id),
      next_node_id_(node_id),
      application_(application),
      port_(port),
      dictionary_(tables, &application),
      sdo_server_(dictionary_, port, buffer) {}

void Slave::start(Time now) {
  reset(true, now);
  while (resetting())
    go_on_with_reset(now);
}

void Slave::reset(bool application, Time now) {
  const bool widens = resetting() && application && !reset_application_;
  reset_application_ = application || (resetting() && reset_application_);  // a reset within one adds to it
  if (state_ != nmt::State::kInitialising || widens) enter(nmt::State::kInitialising, now);
  node_id_ = next_node_id_;
  step_ = 1;
  if constexpr (kServices.sdo_server) sdo_server_->reset(sdo::kResponseId + node_id_);
  next_state_ = nmt::State::kPreOperational;
  guard_toggle_ = 0;
  heartbeat_period_ = 0;
  heartbeat_at_ = kNever;
  wanted_ = 0;
  retry_at_ = now;
}

void Slave::go_on_with_reset(Time now) {
  const std::uint32_t step = step_++;
  if (step == 1 && reset_application_) return application_.restore(0, object::kLast, now);
  if (step == 1) return application_.restore(object::kFirstCommunication, object::kLastCommunication, now);
  if (application_.restore_more(step - 2, now)) return;
  step_ = 0;
  retry_at_ = kNever;
  if (node_id_ > nmt::kMaxNode) return;  // off the bus until start()
  configure(now);
  wanted_ = kBootUp;
  poll(now);
}

void Slave::enter(nmt::State state, Time now) {
  state_ = state;
  if constexpr (kServices.sdo_server)
    if (!nmt::is_running(state)) sdo_server_->reset(sdo::kResponseId + node_id_);  // no more responses
  application_.on_state(state, now);
}

void Slave::change(nmt::State state, Time now) {
  next_state_ = state;
  if (state_ != nmt::State::kInitialising) enter(state, now);
}

void Slave::command(nmt::Command command, Time now) {
  switch (command) {
    case nmt::Command::kStart: return change(nmt::State::kOperational, now);
    case nmt::Command::kStop: return change(nmt::State::kStopped, now);
    case nmt::Command::kEnterPreOperational: return change(nmt::State::kPreOperational, now);
    case nmt::Command::kResetNode: return reset(true, now);
    case nmt::Command::kResetCommunication: return reset(false, now);
  }
}

void Slave::on_frame(const Frame& frame, Time now) {
  if (state_ == nmt::State::kInitialising) return;
  if (frame.id == sdo::kRequestId + node_id_) {
    if (state_ == nmt::State::kStopped) return;
    sdo_server_.on_frame(frame, now);
  } else if (nmt::is_command(frame)) {
    if (frame.data[1] == node_id_ || frame.data[1] == nmt::kAllNodes)
      command(static_cast<nmt::Command>(frame.data[0]), now);
  } else if (frame.id == nmt::kErrorControlId + node_id_ && frame.flags == Frame::kRemote) {
    // A device is guarded or has a heartbeat, not both (CiA 301, 7.2.8.3.2.2).
    if (heartbeat_period_ != 0) return;
    wanted_ |= kGuardResponse;
    poll(now);
  }
}

void Slave::configure(Time now) {
  const auto heartbeat = static_cast<std::uint32_t>(dictionary_.get(object::kProducerHeartbeatTime, 0)) *
                         std::uint32_t{kMillisecond};
  if (heartbeat != heartbeat_period_) heartbeat_at_ = heartbeat == 0 ? kNever : now + heartbeat;
  heartbeat_period_ = heartbeat;
}

Time Slave::poll(Time now) {
  if (resetting()) [[unlikely]] {
    go_on_with_reset(now);
    return deadline();
  }
  if (now >= heartbeat_at_) {
    wanted_ |= kHeartbeat;
    heartbeat_at_ = next_after(heartbeat_at_, heartbeat_period_, now);
  }
  sdo_server_.poll(now);
  retry_at_ = kNever;
  while (wanted_ != 0 && send_wanted(now)) {
  }
  return deadline();
}

bool Slave::send_wanted(Time now) {
  const auto lowest = static_cast<std::uint8_t>(wanted_ & (~wanted_ + 1));
  // Created when it is sent, so that it contains the current state: in a boot-up message this is
  // Initialising.
  auto state = static_cast<std::uint8_t>(state_);
  if (lowest == kGuardResponse) state |= guard_toggle_;
  if (!port_.try_send(nmt::error_control_frame(node_id_, state))) {
    retry_at_ = now + kRetryInterval;
    return false;
  }
  wanted_ = static_cast<std::uint8_t>(wanted_ & ~lowest);
  if (lowest == kGuardResponse) guard_toggle_ ^= nmt::kGuardToggle;
  if (lowest != kBootUp) return true;
  const nmt::State next = next_state_;
  enter(nmt::State::kPreOperational, now);
  if (next != nmt::State::kPreOperational) enter(next, now);
  return true;
}

}  // namespace cbcan
