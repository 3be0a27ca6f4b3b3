// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "A network that the module boots": what LSS does for it; the inhibit time of
// NMT.

#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

/// Node 5 of vendor 22h is listed, and does not respond; `assignment`: 1F81h:05.
struct Unanswered : Window {
  explicit Unanswered(std::uint32_t assignment, const std::function<void(Window&)>& more) {
    put(0x1F81, 5, assignment);
    put(0x1F84, 5, 0x000F0191);
    put(0x1F85, 5, 0x22);
    more(*this);
    put(0x1F80, 0, 1);
    if ((assignment & 0x10) == 0) expect("000#8200");
  }
};

/// Until the module has abandoned the read of 1000h.
void expect_probe(Unanswered& network) {
  network.pass(1s + 110ms).expect("605#4000100000000000", "605#8000100000000405");
  network.expect("7E5#0400000000000000", "7E5#5E00000000000000");
}

/// A step that ends with - has no response.
void expect_scan(Unanswered& network, const std::vector<std::string>& steps) {
  for (const std::string& step : steps) {
    std::string sent = network.target().next_frame();
    while (sent.starts_with("605#"))  // reads of 1000h each second
      sent = network.target().next_frame();
    CHECK(sent == "7E5#51" + step.substr(0, 14));
    if (step.back() != '-') network.arrive("7E4#4F00000000000000");
    network.pass(20ms);
  }
}

/// All four numbers of node 5 are known.
void put_identity(Window& window) {
  window.configure(0x3010, 5, 1, {1});
  for (const unsigned index : {0x1F86u, 0x1F87u, 0x1F88u})
    window.put(index, 5, index & 0xF);
}

}  // namespace

TEST_CASE("[NET-31] a module without a node ID joins") {
  Unanswered network(5, put_identity);
  expect_probe(network);
  for (unsigned i = 0; i != 2; ++i) {
    if (i != 0) network.expect("7E5#0400000000000000", "7E5#5E00000000000000");
    network.pass(20ms);
    expect_scan(network, {"00000000800000", "000000001F0303-", "22000000000001", "06000000000102",
                          "07000000000203", "08000000000300"});
  }
  network.expect("7E5#1105000000000000");
  network.arrive("7E4#1100000000000000").expect("7E5#1700000000000000");
  network.arrive("7E4#1700000000000000").expect("7E5#0400000000000000");
  network.arrive("705#00").expect("605#4000100000000000");
}

TEST_CASE("[NET-32] two that fit") {
  Unanswered network(5, [](Window& window) {
    put_identity(window);
    window.put(0x1F88, 5, 0);
  });
  expect_probe(network);
  network.pass(20ms);
  // The serial numbers are 0 and 1.
  std::vector<std::string> steps{"00000000800000", "000000001F0303-", "22000000000001", "06000000000102",
                                 "07000000000203"};
  for (std::uint32_t bit = 32; bit-- != 0;) {
    const std::uint32_t one = 1u << bit;
    const std::string rest = hex_of(std::vector{bit}) + "0303";
    steps.push_back("00000000" + rest);
    steps.push_back(hex_of(std::vector{one, one >> 8, one >> 16, one >> 24}) + rest + (bit == 0 ? "" : "-"));
  }
  steps.push_back("00000000000300");
  expect_scan(network, steps);
  network.expect("7E5#0400000000000000");
  CHECK(network.reg(3972 + 5) == 0x5500);
}

TEST_CASE("[NET-33] a request in 300Eh ends that of the manager") {
  Unanswered network(5, put_identity);
  expect_probe(network);
  network.write(0, 0x300E, 0, 1, {0x17}).expect("7E5#1700000000000000");
  network.arrive("7E4#1700000000000000").pass(1s + 110ms);
  network.expect("605#4000100000000000", "605#8000100000000405");
}

TEST_CASE("[NET-34] the inhibit time of NMT commands") {
  Unanswered network(0x15, [](Window& window) {
    window.put(0x1F81, 6, 5);
    window.put(0x1F81, 7, 5);
    window.configure(0x102A, 0, 2, {500});
  });
  network.expect("000#8206", "605#4000100000000000");
  network.arrive("585#4300100091010F00").expect("605#4000100000000000");
  network.pass(49ms).expect_silence();
  network.pass(2ms).expect("000#8207");
}
