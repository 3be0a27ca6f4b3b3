// SPDX-License-Identifier: MIT
#pragma once

#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/frame.hpp"
#include "sim/faults/fault.hpp"

namespace cbcan::sim {

/// Looks at the frames between a node's SDO server and its client, and knows which object they are about and
/// what each response is. Segments of blocks have neither multiplexer nor command specifier, so what a
/// response is follows from the frames before it. One that begins in the middle of a transfer knows at the
/// next initiate request.
class SdoWatch {
 public:
  /// A frame on 600h + node ID, before the server has it.
  void on_request(const Frame& frame);
  /// A frame that the server sends on 580h + node ID, as the server made it.
  SdoStep on_response(const Frame& frame);

  /// Of the last initiate request.
  sdo::Multiplexer multiplexer() const { return mux_; }

 private:
  enum class Stream : std::uint8_t { kNone, kFromServer, kFromClient };

  void on_block_upload(const Frame& frame);
  SdoStep block_download_response(const Frame& frame);

  sdo::Multiplexer mux_ = 0;
  Stream stream_ = Stream::kNone;
  std::uint8_t last_segment_ = 0;  ///< number of the one that was marked as the last; 0 = none yet
};

}  // namespace cbcan::sim
