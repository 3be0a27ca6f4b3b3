// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan::io {

/// A frame as python-can's udp_multicast sends it: a MessagePack map (github.com/msgpack/msgpack, spec.md) of
/// what a can.Message has. `time` is microseconds since 1970.
std::vector<std::uint8_t> pack_frame(const Frame& frame, Time time);

/// Reads one; keys may come in any order, and others than those of a classical frame too. None for anything
/// else, CAN FD and error frames.
std::optional<Frame> unpack_frame(std::span<const std::uint8_t> bytes);

}  // namespace cbcan::io
