/* SPDX-License-Identifier: MIT */
void RES0_init__(void);
void RES0_run__(unsigned long tick);
unsigned long long common_ticktime__ = 100000000ULL; /* ns */

void config_init__(void) {
  RES0_init__();
}
void config_run__(unsigned long tick) {
  RES0_run__(tick);
}
