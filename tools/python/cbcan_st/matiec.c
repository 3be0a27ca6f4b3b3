/* SPDX-License-Identifier: MIT */
/* What compiled.py calls, for a program that MATIEC's iec2c has translated. It writes generated.h. */
#include "iec_std_lib.h"

#include "POUS.h"

#include "generated.h"

void config_init__(void);
void config_run__(unsigned long tick);
extern unsigned long long common_ticktime__;
TIME __CURRENT_TIME;
BOOL __DEBUG;

#define __LOCATED_VAR(type, name, ...) \
  static type cell##name;              \
  type* name = &cell##name;
LOCATED
#undef __LOCATED_VAR
#define __LOCATED_VAR(type, name, ...) &cell##name,
static void* const located[] = {LOCATED 0};

const char* names(void) {
  return NAMES;
}
void* value_of(int i) {
  return located[i];
}
void* register_of(int i) {
  return REGISTERS;
}
int done(void) {
  return IS_DONE;
}
int gave_up(void) {
  return HAS_GIVEN_UP;
}

unsigned long long start(void) {
  config_init__();
  return common_ticktime__;
}

void scan(unsigned long tick, long long now) {
  __CURRENT_TIME.tv_sec = now / 1000000;
  __CURRENT_TIME.tv_nsec = now % 1000000 * 1000;
  config_run__(tick);
}
