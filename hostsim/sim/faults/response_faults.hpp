// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/frame.hpp"
#include "sim/faults/fault.hpp"

namespace cbcan::sim {

/// An SDO response within its transfer.
struct SdoResponse {
  SdoStep step;
  sdo::Multiplexer mux;  ///< of the transfer
};

/// Is this fault about transfers of this object?
bool is_about(const Fault& fault, std::uint16_t index, std::uint8_t sub);

/// Is it about this response: the right object and step, and with something in it that the fault
/// changes?
bool is_about(const Fault& fault, const SdoResponse& response, const Frame& frame);

/// The frame that goes out instead; of a fault about when it does, the same.
Frame changed(const Fault& fault, const SdoResponse& response, const Frame& frame);

/// What another device with the same node ID says to the same request: the same but for its data.
Frame response_of_duplicate(const SdoResponse& response, const Frame& frame);

}  // namespace cbcan::sim
