// SPDX-License-Identifier: MIT
#pragma once

/// The measurements of cbcan-bench. Each prints its figures and throws if an outcome was wrong.

#include <ctime>
#include <stdexcept>
#include <string>
#include <vector>

namespace cbcan::bench {

class Arguments {
 public:
  explicit Arguments(std::vector<std::string> words) : words_(std::move(words)) {}

  std::size_t size() const { return words_.size(); }
  /// Decimal or hexadecimal. Throws std::logic_error if it is not in its range.
  unsigned number(std::size_t at, unsigned otherwise, unsigned least = 0, unsigned most = 100'000'000) const {
    if (at >= words_.size()) return otherwise;
    const unsigned long value = std::stoul(words_[at], nullptr, 0);
    if (value < least || value > most) throw std::out_of_range(words_[at]);
    return static_cast<unsigned>(value);
  }
  const std::string& word(std::size_t at) const { return words_.at(at); }

 private:
  std::vector<std::string> words_;
};

inline void require(bool good, const std::string& what) {
  if (!good) throw std::runtime_error(what);
}

inline double processor_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

// core.cpp
void core(const Arguments& arguments);
// library.cpp
void tr308(const Arguments& arguments);
// load.cpp
void load(const Arguments& arguments);
// scenarios.cpp
void scenarios(const Arguments& arguments);
// worlds.cpp
void plant(const Arguments& arguments);
void scripts(const Arguments& arguments);
void device(const Arguments& arguments);
void hostile(const Arguments& arguments);
void eds(const Arguments& arguments);

}  // namespace cbcan::bench
