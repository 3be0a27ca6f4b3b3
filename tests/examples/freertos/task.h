// SPDX-License-Identifier: MIT
#pragma once

#include "FreeRTOS.h"
