// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/frame.hpp"
#include "sim/faults/fault.hpp"

namespace cbcan::sim {

/// Follows the frames between a node's SDO server and its client, and finds out their object and the step of
/// each response. Segments of blocks have neither multiplexer nor command specifier, so the step follows from
/// earlier frames. A watch that begins in the middle of a transfer is right from the next initiate request
/// on.
class SdoWatch {
 public:
  /// A frame on 600h + node ID, before the server gets it.
  void on_request(const Frame& frame);
  /// A frame on 580h + node ID, as the server sent it.
  SdoStep on_response(const Frame& frame);

  /// Object of the last initiate request.
  sdo::Multiplexer multiplexer() const { return mux_; }

 private:
  enum class Stream : std::uint8_t { kNone, kFromServer, kFromClient };

  void on_block_upload(const Frame& frame);
  SdoStep block_download_response(const Frame& frame);

  sdo::Multiplexer mux_ = 0;
  Stream stream_ = Stream::kNone;
  std::uint8_t last_segment_ = 0;  ///< number of the segment that was marked as the last; 0 = none yet
};

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
