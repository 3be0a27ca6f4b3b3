// SPDX-License-Identifier: MIT
// Debian's luaconf.h takes the folder of C libraries from here; no library is loaded.
#pragma once

#define DEB_HOST_MULTIARCH ""
