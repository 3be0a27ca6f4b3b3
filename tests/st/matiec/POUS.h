/* SPDX-License-Identifier: MIT */
typedef struct {
  struct {
    WORD* value;
  } FLAG, COMMAND, NODE, INDEX, PART, SIZE, DATA;
  struct {
    BOOL value;
  } WRITES, ASKED, CLOSING, DONE;
  TIME SINCE;
} FILL;
