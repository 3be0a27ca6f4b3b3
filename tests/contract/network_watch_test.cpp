// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "A network that the module boots": node guarding, and nodes that nothing
// watches.

#include "contract/network.hpp"

using namespace cbcan::contract;

namespace {

/// Guard time 200 ms, retry factor 3, instead of the time in 1016h.
struct Guarded : Network {
  explicit Guarded(std::uint32_t flags = 5)
      : Network(1, 0x00C80300 | flags, [](Window& window) { window.put(0x1016, 1, 0); }) {}
};

void boot_guarded(Guarded& network) {
  network.exchange(kCheck).exchange(kWrites).expect("705#R1");
  CHECK(network.of(5) == 0x057F);
  network.arrive("705#7F").expect("000#0105");
  network.pass(210ms).expect("705#R1");
  network.arrive("705#85").expect_silence();
  CHECK((network.of(5) == 0x0105 && network.reg(3928) == 0x11));
}

}  // namespace

TEST_CASE("[NET-9] [NET-15] [NET-26] a guarded node") {
  Guarded network;
  boot_guarded(network);
  for (const char* const response : {"705#05", "705#85"}) {
    network.pass(180ms).expect_silence();
    network.pass(20ms).expect("705#R1");
    network.arrive(response);
  }
  CHECK(network.of(5) == 0x0105);
  const bool same_toggle_bit = GENERATE(false, true);  // or no response
  for (unsigned i = 0; i != 3; ++i) {
    network.pass(200ms).expect("705#R1");
    if (same_toggle_bit) network.arrive("705#85");
    CHECK(network.of(5) == 0x0105);
  }
  network.pass(200ms).expect("705#R1");
  CHECK((network.of(5) == 0x5800 && network.in_map(kLost, 5)));
  SECTION("Operational again") {
    network.arrive("705#05").expect_silence();
    CHECK(network.of(5) == 0x0105);
  }
  SECTION("in another state") {
    network.arrive("705#7F").expect("605#4000100000000000");
  }
}

TEST_CASE("[NET-26] 1016h of the own node precedes") {
  Network network(1, 0x00C80305);
  boot(network);
  network.pass(240ms).expect_silence();
}

TEST_CASE("[NET-13] [NET-27] no response to node guarding") {
  Guarded network;
  network.exchange(kCheck).exchange(kWrites).pass(590ms).expect("705#R1", "705#R1", "705#R1");
  CHECK(network.of(5) == 0x057F);
  network.pass(20ms).expect_silence();
  CHECK(network.of(5) == 0x467F);
  network.pass(1s).expect("605#4000100000000000");
}

TEST_CASE("[NET-8] [NET-26] a keep-alive node that is guarded") {
  Guarded network(0x15);
  network.exchange({kCheck[1], kCheck[1], kCheck[2]}).expect("705#R1");
  SECTION("Operational") {
    network.arrive(GENERATE(as<std::string>{}, "705#05", "705#85")).expect_silence();
    CHECK(network.of(5) == 0x0105);
    network.pass(210ms).expect("705#R1");
  }
  SECTION("without a state") {
    network.pass(610ms).expect("705#R1", "705#R1", "000#8205");
  }
}

TEST_CASE("[STAT-5] a running node that is not watched") {
  const auto assignment = GENERATE(5u, 0x00640005u, 0x00000305u);
  Network network(1, assignment, [](Window& window) { window.put(0x1016, 1, 0); });
  network.exchange(kCheck).exchange(kWrites).expect("000#0105");
  network.arrive("705#05").expect_silence();
  CHECK((network.of(5) == 0x0100 && network.reg(3928) == 0x211));
  CHECK((network.in_map(kHeard, 5) && network.in_map(kRunning, 5)));
  const unsigned changes = network.reg(3929);
  network.put(0x1016, 1, 0x000500FA);
  CHECK((network.of(5) == 0x0105 && network.reg(3928) == 0x011 && network.reg(3929) != changes));
}
