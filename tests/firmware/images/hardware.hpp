// SPDX-License-Identifier: MIT
#pragma once

/// The hardware of the images that are linked for their size: one struct in memory that does not exist.

#include "cbcan/can_port.hpp"

struct Hardware {
  volatile bool sent;
  volatile bool received;
  volatile std::uint16_t first;    ///< registers that the PLC has written
  volatile std::uint16_t written;  ///< number of these
  cbcan::Frame out;
  cbcan::Frame in;
  volatile cbcan::Time now;
};
inline Hardware& hardware = *reinterpret_cast<Hardware*>(0x40000000);

struct Port final : cbcan::CanPort {
  bool try_send(const cbcan::Frame& frame) override {
    hardware.out = frame;
    return hardware.sent;
  }
};
