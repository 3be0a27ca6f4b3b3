// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstdint>
#include <functional>

namespace cbcan::test {

/// A driver's access to a model: boards/common/registers.hpp. A model throws, which ends the suite, if the
/// driver does what the manual forbids.
template <class Model>
struct ModelRegisters {
  explicit ModelRegisters(Model& model) : model_(&model) {}
  std::uint32_t read(std::uint32_t offset) const noexcept { return model_->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const noexcept { model_->write(offset, value); }

 private:
  Model* model_;
};

/// The same for any model; a function may be called before each access.
struct SharedRegisters {
  using Happening = std::function<void()>;

  template <class Model>
  requires(!std::same_as<Model, SharedRegisters>) explicit SharedRegisters(Model& model)
      : read_([&](std::uint32_t offset) { return model.read(offset); }),
        write_([&](std::uint32_t offset, std::uint32_t value) { model.write(offset, value); }) {}
  template <class Model>
  SharedRegisters(Model& model, const Happening& before)
      : read_([&](std::uint32_t offset) { return before(), model.read(offset); }),
        write_([&](std::uint32_t offset, std::uint32_t value) { before(), model.write(offset, value); }) {}
  std::uint32_t read(std::uint32_t offset) const noexcept { return read_(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const noexcept { write_(offset, value); }

 private:
  std::function<std::uint32_t(std::uint32_t)> read_;
  std::function<void(std::uint32_t, std::uint32_t)> write_;
};

}  // namespace cbcan::test
