/* SPDX-License-Identifier: MIT */
#include "iec_std_lib.h"

#include "POUS.h"

#include "Config0.h"

#include "POUS.c"

FILL RES0__MAIN;

void RES0_init__(void) {
  FILL_init__(&RES0__MAIN);
}
void RES0_run__(unsigned long tick) {
  FILL_body__(&RES0__MAIN);
}
