// SPDX-License-Identifier: MIT
#include "io/can/can_frames.hpp"

#include <linux/can/error.h>

#include <algorithm>

namespace cbcan::io {

can_frame to_kernel(const Frame& frame) {
  can_frame kernel{};
  kernel.can_id = frame.id;
  if ((frame.flags & Frame::kExtended) != 0) kernel.can_id |= CAN_EFF_FLAG;
  if ((frame.flags & Frame::kRemote) != 0) kernel.can_id |= CAN_RTR_FLAG;
  if ((frame.flags & Frame::kError) != 0) kernel.can_id |= CAN_ERR_FLAG;
  kernel.can_dlc = frame.length;
  std::copy(frame.data.begin(), frame.data.end(), kernel.data);
  return kernel;
}

Frame from_kernel(const can_frame& kernel) {
  const bool error = (kernel.can_id & CAN_ERR_FLAG) != 0;
  const bool extended = (kernel.can_id & CAN_EFF_FLAG) != 0;
  Frame frame;
  frame.id = kernel.can_id & (error || extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  if (extended) frame.flags |= Frame::kExtended;
  if ((kernel.can_id & CAN_RTR_FLAG) != 0) frame.flags |= Frame::kRemote;
  if (error) frame.flags |= Frame::kError;
  frame.length = std::min<std::uint8_t>(kernel.can_dlc, CAN_MAX_DLEN);
  if ((frame.flags & Frame::kRemote) == 0) std::copy_n(kernel.data, frame.length, frame.data.begin());
  return frame;
}

ControllerReport read_error_frame(const Frame& frame) {
  if ((frame.flags & Frame::kError) == 0) return {};
  if ((frame.id & CAN_ERR_BUSOFF) != 0) return {BusState::kBusOff, false};
  if ((frame.id & CAN_ERR_RESTARTED) != 0) return {BusState::kActive, false};
  if ((frame.id & CAN_ERR_CRTL) == 0) return {};
  const unsigned details = frame.data[1];
  ControllerReport report;
  report.overflow = (details & CAN_ERR_CRTL_RX_OVERFLOW) != 0;
  if ((details & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0)
    report.state = BusState::kErrorPassive;
  else if ((details & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING | CAN_ERR_CRTL_ACTIVE)) != 0)
    report.state = BusState::kActive;  // a warning is also sent when error passive ends
  return report;
}

}  // namespace cbcan::io
