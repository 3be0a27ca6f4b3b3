// SPDX-License-Identifier: MIT
// Does one of the runs a number of times, for core_instructions to count. Without arguments: lists them.
#include <cstdio>
#include <cstdlib>

#include "runs.hpp"

int main(int argc, char** argv) {
  const auto runs = cbcan::bench::runs();
  if (argc != 3) {
    for (const cbcan::bench::Run& run : runs)
      std::printf("%u\t%s\n", run.limit, run.name);
    return 0;
  }
  const auto which = static_cast<std::size_t>(std::atoi(argv[1]));
  if (which < runs.size() && runs[which].run(static_cast<unsigned>(std::atoi(argv[2])))) return 0;
  std::fprintf(stderr, "cbcan-counted: run %s went wrong\n", argv[1]);
  return 1;
}
