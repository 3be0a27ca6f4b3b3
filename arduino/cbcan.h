// SPDX-License-Identifier: MIT
#pragma once

// The whole library, for sketches.
#include "boards/common/clock.hpp"
#include "boards/common/ring.hpp"
#include "cbcan/coprocessor/coprocessor.hpp"
#include "cbcan/modbus/rtu_server.hpp"
