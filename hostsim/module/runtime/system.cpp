// SPDX-License-Identifier: MIT
// The functions of the operating system that wasi-libc would import (WASI, snapshot preview 1): here there is
// none, so the module imports nothing. There are no files, no clock and no environment.

#include <cstdint>

namespace {

using Int = std::int32_t;
using Long = std::int64_t;

constexpr Int kBadDescriptor = 8;  // WASI's badf

}  // namespace

#define CBCAN_ABSENT(name, ...)                               \
  Int __imported_wasi_snapshot_preview1_##name(__VA_ARGS__) { \
    return kBadDescriptor;                                    \
  }

extern "C" {

CBCAN_ABSENT(clock_time_get, Int, Long, Int)
CBCAN_ABSENT(environ_get, Int, Int)
CBCAN_ABSENT(fd_close, Int)
CBCAN_ABSENT(fd_fdstat_get, Int, Int)
CBCAN_ABSENT(fd_fdstat_set_flags, Int, Int)
CBCAN_ABSENT(fd_prestat_dir_name, Int, Int, Int)
CBCAN_ABSENT(fd_prestat_get, Int, Int)
CBCAN_ABSENT(fd_read, Int, Int, Int, Int)
CBCAN_ABSENT(fd_renumber, Int, Int)
CBCAN_ABSENT(fd_seek, Int, Long, Int, Int)
CBCAN_ABSENT(fd_write, Int, Int, Int, Int)
CBCAN_ABSENT(path_open, Int, Int, Int, Int, Int, Long, Long, Int, Int)

Int __imported_wasi_snapshot_preview1_environ_sizes_get(Int* count, Int* size) {
  *count = *size = 0;
  return 0;
}

[[noreturn]] void __imported_wasi_snapshot_preview1_proc_exit(Int) {
  __builtin_trap();
}

}  // extern "C"
