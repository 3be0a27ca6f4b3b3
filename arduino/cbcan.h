// SPDX-License-Identifier: MIT
#pragma once

// All of the library, for sketches.
#include "boards/common/clock.hpp"
#include "boards/common/ring.hpp"
#include "cbcan/coprocessor/coprocessor.hpp"
#include "cbcan/modbus/rtu_server.hpp"
