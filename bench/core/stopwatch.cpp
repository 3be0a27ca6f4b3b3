// SPDX-License-Identifier: MIT
// Time per transfer of the core, by Google Benchmark; the far end of the wire is part of it.
#include <benchmark/benchmark.h>

#include "runs.hpp"

int main(int argc, char** argv) {
  constexpr unsigned kBatch = 1000;
  for (const cbcan::bench::Run& run : cbcan::bench::runs())
    benchmark::RegisterBenchmark(run.name, [&run](benchmark::State& state) {
      while (state.KeepRunningBatch(kBatch))
        if (!run.run(kBatch)) state.SkipWithError("an outcome was wrong");
    });
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
}
