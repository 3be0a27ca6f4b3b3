/* SPDX-License-Identifier: MIT */
#include <stdint.h>
typedef uint8_t BOOL;
typedef uint16_t WORD, UINT;
typedef struct {
  long tv_sec, tv_nsec;
} TIME;
extern TIME __CURRENT_TIME;
