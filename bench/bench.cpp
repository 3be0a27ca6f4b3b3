// SPDX-License-Identifier: MIT
// One program for all measurements of the host; README.md describes how each figure is measured.
#include "bench.hpp"

#include <cstdio>
#include <cstring>

namespace {

using namespace cbcan::bench;

struct Measurement {
  const char* name;
  const char* arguments;
  const char* what;
  std::size_t least, most;  ///< arguments
  void (*run)(const Arguments& arguments);
};

constexpr Measurement kMeasurements[] = {
    {"core", "", "transfers of the core, 1,000 and 2,000 of each, for `instructions` to count", 0, 0, core},
    {"plant", "[SECONDS]", "127 nodes, SYNC at 1 kHz", 0, 1, plant},
    {"scripts", "[SECONDS]", "127 Lua devices, called 100 times a second each", 0, 1, scripts},
    {"device", "LINES", "four seconds of one node with these lines of a plant file", 1, 1, device},
    {"eds", "[TIMES]", "reads the demo plant's EDS files", 0, 1, eds},
    {"hostile", "", "Lua devices that would stop the plant", 0, 0, hostile},
    {"scenarios", "FILE...", "what --explore costs for each scenario", 1, 1000, scenarios},
    {"tr308", "", "the terms of CiA TR 308", 0, 0, tr308},
    {"load", "PORT CLIENTS TRANSACTIONS NODE INDEX SIZE", "SDO reads by Modbus TCP clients", 6, 6, load},
};

int usage() {
  std::fputs("usage: cbcan-bench NAME [ARGUMENTS]\n", stderr);
  for (const Measurement& row : kMeasurements)
    std::fprintf(stderr, "  %-12s %s\n      %s\n", row.name, row.arguments, row.what);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  for (const Measurement& row : kMeasurements) {
    if (argc < 2 || std::strcmp(argv[1], row.name) != 0) continue;
    const Arguments arguments({argv + 2, argv + argc});
    if (arguments.size() < row.least || arguments.size() > row.most) return usage();
    try {
      row.run(arguments);
      return 0;
    } catch (const std::logic_error&) {  // thrown by number()
      return usage();
    } catch (const std::exception& error) {
      return std::fprintf(stderr, "cbcan-bench %s: %s\n", row.name, error.what()), 1;
    }
  }
  return usage();
}
