/* SPDX-License-Identifier: MIT */
/* The generated header as a C89 compiler sees it, against the document's numbers. */
#include "cbcan/regmap.h"

#define CHECK(name, condition) typedef char name[(condition) ? 1 : -1]

CHECK(window_first, CBCAN_R_EXECUTE_FLAG == 3700);
CHECK(window_last, CBCAN_R_DATA_LAST == 3769);
CHECK(data, CBCAN_R_DATA == 3706);
CHECK(execute, CBCAN_EXECUTE == 0xCA0E);
CHECK(read, CBCAN_COMMAND_SDO_READ == 5055);
CHECK(write, CBCAN_COMMAND_SDO_WRITE == 5066);
CHECK(result, CBCAN_RESULT_SDO_EXEC_ERR == 4);
CHECK(nmt, CBCAN_OBJECT_NMT == 0x1F82);
CHECK(state, CBCAN_OBJECT_NODE_STATE == 0x300C);
CHECK(start, CBCAN_NMT_START_REMOTE_NODE == 5);
CHECK(time_out, CBCAN_ABORT_TIME_OUT == 0x05040000UL);

int main(void) { return 0; }
