// SPDX-License-Identifier: MIT
// Lua compiled as C++, so without extern "C".
#pragma once

#include "lua.h"

#include "lauxlib.h"
#include "lualib.h"
