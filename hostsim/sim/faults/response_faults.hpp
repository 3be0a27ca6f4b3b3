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

/// Whether this fault selects transfers of this object.
bool is_about(const Fault& fault, std::uint16_t index, std::uint8_t sub);

/// Whether it selects this response: object and step match, and the response has the field that the fault
/// changes.
bool is_about(const Fault& fault, const SdoResponse& response, const Frame& frame);

/// The frame that is sent instead; the same if the fault changes only when it is sent.
Frame changed(const Fault& fault, const SdoResponse& response, const Frame& frame);

/// The response of another device with the same node ID to the same request: the same with its data inverted.
Frame response_of_duplicate(const SdoResponse& response, const Frame& frame);

}  // namespace cbcan::sim
