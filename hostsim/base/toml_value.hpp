// SPDX-License-Identifier: MIT
#pragma once

#include <toml++/toml.h>

#include <optional>

#include "base/value.hpp"

namespace cbcan::base {

/// nullopt for dates, tables and arrays, which no setting accepts.
inline std::optional<Value> value_of(const toml::node& node) {
  if (const auto* boolean = node.as_boolean()) return boolean->get();
  if (const auto* integer = node.as_integer()) return integer->get();
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* text = node.as_string()) return text->get();
  return std::nullopt;
}

}  // namespace cbcan::base
