// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "sim/parameters.hpp"

namespace cbcan::io {

/// The file is created when something is stored for the first time, and replaced atomically: a crash leaves
/// the old one or the new one. load() throws UsageError also for one that cannot be read.
class ParameterFile final : public sim::ParameterText {
 public:
  using sim::ParameterText::ParameterText;

  /// Nullopt: there is no such file yet. Throws UsageError.
  static std::optional<std::string> text_of(const std::string& path);

 private:
  std::optional<std::string> read() override { return text_of(path_); }
  bool write(const std::string& text) override;
};

}  // namespace cbcan::io
