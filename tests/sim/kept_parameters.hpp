// SPDX-License-Identifier: MIT
#pragma once

#include "sim/parameters.hpp"

namespace cbcan::test {

/// Parameters that outlive a node; saving fails when `works` is false.
struct KeptParameters final : sim::ParameterStore {
  sim::StoredParameters load() override { return kept; }
  bool save(const sim::StoredParameters& parameters) override {
    if (works) kept = parameters;
    return works;
  }
  void tell_left_out(const std::vector<sim::StoredValue>& values) override { left_out = values; }
  sim::StoredParameters kept;
  bool works = true;
  std::vector<sim::StoredValue> left_out;
};

}  // namespace cbcan::test
