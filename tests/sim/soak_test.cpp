// SPDX-License-Identifier: MIT
// Eight PLCs on four networks, one at R3700 and one at the scanner window of each, in virtual time, with faults and
// with restarts of nodes, modules and PLCs. Each result is right, or an abort that a fault of that time explains;
// nothing is executed twice or in another order.

#include "sim/soak_plc.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

struct Row {
  std::uint32_t bit_rate;
  std::uint16_t timeout_ms;
  Time patience;
};
/// PLCs with a patience of kNever do not cancel: with 500 ms a response may come after the quarantine of a cancel.
constexpr Row kNetworks[] = {{0, 1000, 300 * kMillisecond},
                             {0, 500, kNever},
                             {250'000, 1000, 300 * kMillisecond},
                             {1'000'000, 500, kNever}};

struct Sum {
  std::uint64_t ended = 0, good = 0, failed = 0, unknown = 0, fired = 0, restarts = 0, writes = 0;
};

void run_network(std::uint64_t seed, const Row& row, Time end, Sum& sum) {
  SoakNetwork network(seed, row.bit_rate, row.timeout_ms);
  FlagAccess flag(network);
  ScannerAccess scanner(network);
  SoakPlc plcs[] = {{network, flag, 0, seed + 1, row.patience},
                    {network, scanner, 1, seed + 2, row.patience}};
  while (network.now < end) {
    const Time next = std::min({network.next(), plcs[0].wake(), plcs[1].wake(), end});
    network.advance(std::max(next, network.now));
    for (SoakPlc& plc : plcs)
      if (plc.wake() <= network.now) plc.act();
  }
  for (const SoakPlc& plc : plcs) {
    CHECK(plc.wrong == std::vector<std::string>());
    sum.ended += plc.ended;
    sum.good += plc.good;
    sum.failed += plc.failed;
    sum.unknown += plc.unknown;
  }
  CHECK(network.executed.again == 0);
  CHECK(network.executed.torn == 0);
  sum.fired += network.fired;
  sum.restarts += network.lives - 1;
  sum.writes += network.executed.writes;
}

void soak(Time duration, std::uint64_t least) {
  Sum sum;
  std::uint64_t seed = 1;
  for (const Row& row : kNetworks)
    run_network(seed += 1000, row, duration, sum);
  std::cout << sum.ended << " transactions in " << duration / kSecond << " s: " << sum.good << " good, "
            << sum.failed << " failed, " << sum.unknown << " without a result; " << sum.writes
            << " writes executed, faults happened " << sum.fired << " times, " << sum.restarts
            << " restarts\n";
  CHECK(sum.ended >= least);
  CHECK(sum.failed > least / 100);
  CHECK(sum.restarts > 0);
}

}  // namespace

TEST_CASE("Eight PLCs for a quarter of an hour, with faults and restarts") {
  soak(900 * kSecond, 10'000);
}

TEST_CASE("Eight PLCs for a day, with faults and restarts", "[.long]") {
  soak(86'400 * kSecond, 1'000'000);
}
