// SPDX-License-Identifier: MIT
// Lua includes it, and as C++ does not use it.
#pragma once
