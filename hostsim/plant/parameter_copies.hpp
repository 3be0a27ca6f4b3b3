// SPDX-License-Identifier: MIT
#pragma once

/// Private copies of parameter files: what 1010h and LSS store lasts as long as the plant, power cuts
/// included.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "sim/parameters.hpp"

namespace cbcan::plant {

class ParameterCopies {
 public:
  using Texts = std::map<std::string, std::optional<std::string>>;  ///< by path; nullopt = there is none yet

  ParameterCopies() = default;
  explicit ParameterCopies(const Texts& texts) {
    for (const auto& [path, text] : texts)
      copies_.emplace(path, std::make_unique<Copy>(path, text));
  }

  /// Null for the empty path.
  sim::ParameterStore* find(const std::string& path) const {
    const auto found = copies_.find(path);
    return found == copies_.end() ? nullptr : found->second.get();
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

  std::map<std::string, std::unique_ptr<Copy>> copies_;
};

}  // namespace cbcan::plant
