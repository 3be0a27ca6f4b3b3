/* SPDX-License-Identifier: MIT */
/* Runs a program that MATIEC has translated. First a line with the names of its words, then for each line
   with the time in us and its words of %IW a line with those of %QW. */
#include <inttypes.h>
#include <stdio.h>

#include "iec_std_lib.h"

void config_init__(void);
void config_run__(unsigned long tick);

TIME __CURRENT_TIME;
BOOL __DEBUG;

#define __LOCATED_VAR(type, name, ...) \
  static type cell##name;              \
  type* name = &cell##name;
#include "words.h"
#undef __LOCATED_VAR

struct Word {
  const char* name;
  WORD* value;
};

static const struct Word words[] = {
#define __LOCATED_VAR(type, name, ...) {#name, &cell##name},
#include "words.h"
#undef __LOCATED_VAR
};
enum { COUNT = sizeof words / sizeof *words };

int main(void) {
  int64_t now;
  config_init__();
  for (int i = 0; i < COUNT; ++i)
    printf("%%%s ", words[i].name + 2);
  puts("");
  fflush(stdout);
  for (unsigned long tick = 0; scanf("%" SCNd64, &now) == 1; ++tick) {
    for (int i = 0; i < COUNT; ++i)
      if (words[i].name[2] == 'I' && scanf("%" SCNu16, words[i].value) != 1) return 1;
    __CURRENT_TIME.tv_sec = now / 1000000;
    __CURRENT_TIME.tv_nsec = now % 1000000 * 1000;
    config_run__(tick);
    for (int i = 0; i < COUNT; ++i)
      if (words[i].name[2] == 'Q') printf("%u ", *words[i].value);
    puts("");
    fflush(stdout);
  }
  return 0;
}
