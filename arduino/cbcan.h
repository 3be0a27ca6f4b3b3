// SPDX-License-Identifier: MIT
#pragma once

// All of the library, for sketches.
#include "boards/common/clock.hpp"
#include "boards/common/ring.hpp"
#include "coprocessor/coprocessor.hpp"
#include "modbus/rtu_server.hpp"
