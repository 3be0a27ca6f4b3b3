// SPDX-License-Identifier: MIT
// 10,000 transactions with a simulated node in virtual time, in this process; fails where they take a second.
#include <cbcan/sim.hpp>

#include <chrono>
#include <cstdio>

int main() {
  constexpr int kTransactions = 10'000;
  cbcan::Plant plant = cbcan::Plant::demo();
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kTransactions; ++i) {
    plant.write(3700, {0xCA0E, 5055, 0x42, 0x1000, 0, 4});
    if (plant.registers(3700, 1)[0] != 0) return 1;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::printf("%d transactions in %.3f s, %.0f a second\n", kTransactions, took.count(),
              kTransactions / took.count());
  return took.count() < 1 ? 0 : 1;
}
