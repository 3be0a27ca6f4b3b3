// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace cbcan::test {

/// What a driver is given of a model: boards/common/registers.hpp. A model that throws ends the suite: the
/// driver has done what the manual forbids.
template <class Model>
struct ModelRegisters {
  explicit ModelRegisters(Model& model) : model_(&model) {}
  std::uint32_t read(std::uint32_t offset) const noexcept { return model_->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const noexcept { model_->write(offset, value); }

 private:
  Model* model_;
};

}  // namespace cbcan::test
