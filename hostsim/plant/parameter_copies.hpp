// SPDX-License-Identifier: MIT
#pragma once

/// Private copies of parameter files: what 1010h and LSS store lasts as long as the plant, power cuts
/// included.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/files.hpp"
#include "sim/parameters.hpp"

namespace cbcan::plant {

class ParameterCopies {
 public:
  explicit ParameterCopies(base::FileReader read) : read_(std::move(read)) {}

  /// Reads the file the first time; throws what the reader throws.
  sim::ParameterStore* find(const std::string& path) {
    std::unique_ptr<Copy>& copy = copies_[path];
    if (!copy) copy = std::make_unique<Copy>(path, read_(path));
    return copy.get();
  }

 private:
  class Copy final : public sim::ParameterText {
   public:
    Copy(const std::string& path, std::optional<std::string> text)
        : ParameterText(path, [](const std::string& /*line*/) {}), text_(std::move(text)) {}

   private:
    std::optional<std::string> read() override { return text_; }
    bool write(const std::string& text) override {
      text_ = text;
      return true;
    }

    std::optional<std::string> text_;
  };

  base::FileReader read_;
  std::map<std::string, std::unique_ptr<Copy>> copies_;
};

}  // namespace cbcan::plant
