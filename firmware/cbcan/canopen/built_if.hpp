// SPDX-License-Identifier: MIT
#pragma once

/// A part that only builds with its service have (cbcan/services.hpp). Elsewhere it is an empty Part, and
/// `->` a null pointer: use that in `if constexpr`, or after the service and `&&`.

#include <utility>

#include "cbcan/canopen/part.hpp"

namespace cbcan {

template <bool kIsBuilt, class T>
class BuiltIf final : public T {
 public:
  explicit BuiltIf(auto&&... arguments) : T(std::forward<decltype(arguments)>(arguments)...) {}
  T* operator->() { return this; }
  const T* operator->() const { return this; }
};

template <class T>
class BuiltIf<false, T> final : public Part {
 public:
  /// Takes the arguments of T's constructor.
  explicit BuiltIf(const auto&... /*arguments*/) {}
  constexpr T* operator->() const { return nullptr; }
};

}  // namespace cbcan
