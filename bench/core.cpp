// SPDX-License-Identifier: MIT
#include <valgrind/callgrind.h>

#include <cstdio>

#include "bench.hpp"
#include "core/runs.hpp"

namespace cbcan::bench {

void core(const Arguments& /*arguments*/) {
  for (const Run& run : runs()) {
    std::printf("%s\n", run.name);
    require(run.run(1),
            "an outcome was wrong");  // the dynamic linker resolves library functions at the first call
    for (const unsigned count : {1000u, 2000u}) {
      CALLGRIND_ZERO_STATS;
      const bool good = run.run(count);
      CALLGRIND_DUMP_STATS;
      require(good, "an outcome was wrong");
    }
  }
}

}  // namespace cbcan::bench
