// SPDX-License-Identifier: MIT
#pragma once

// The whole library, for sketches.
#include "boards/common/clock.hpp"
#include "boards/common/mcp2515.hpp"
#include "boards/common/parameter_store.hpp"
#include "boards/common/ring.hpp"
#include "cbcan/canopen/updatable_device.hpp"
#include "cbcan/coprocessor/coprocessor.hpp"
#include "cbcan/modbus/rtu_server.hpp"
