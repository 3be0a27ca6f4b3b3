// SPDX-License-Identifier: MIT
// Runs a suite and prints how many cases ran. Fails if none did, which Catch2 2 calls a success, or if the
// number of skipped cases is not CBCAN_SKIPS (from CMakeLists.txt).
#define CATCH_CONFIG_RUNNER
#include "support/cases.hpp"
#include "support/catch.hpp"
#include "support/skips.hpp"

namespace {

#if __has_include(<catch2/catch_all.hpp>)
using ListenerBase = Catch::EventListenerBase;
#else
using ListenerBase = Catch::TestEventListenerBase;
#endif

std::optional<std::size_t> g_ran;  // none: the cases were only listed

/// Only newer versions of Catch2 have cases that skip themselves.
template <typename Counts>
std::size_t skipped(const Counts& counts) {
  if constexpr (requires { counts.skipped; }) return static_cast<std::size_t>(counts.skipped);
  return 0;
}

struct CaseCounter : ListenerBase {
  using ListenerBase::ListenerBase;
  void testCaseStarting(const Catch::TestCaseInfo& info) override {
    cbcan::test::skips().running = info.name;
    ListenerBase::testCaseStarting(info);
  }
  void testRunEnded(const Catch::TestRunStats& stats) override {
    const Catch::Counts& cases = stats.totals.testCases;
    g_ran = static_cast<std::size_t>(cases.total()) - skipped(cases);
    ListenerBase::testRunEnded(stats);
  }
};

}  // namespace

CATCH_REGISTER_LISTENER(CaseCounter)

int main(int argc, char** argv) {
  Catch::Session session;
  const int result = session.run(argc, argv);
  if (!g_ran) return result;
  const auto& skips = cbcan::test::skips().why;
  for (const auto& [name, why] : skips)
    std::cout << "skipped: " << name << "\n    because " << why << "\n";
  const bool as_announced = cbcan::test::as_many_skipped(skips.size());
  return cbcan::test::any_ran(*g_ran) && as_announced ? result : EXIT_FAILURE;
}
