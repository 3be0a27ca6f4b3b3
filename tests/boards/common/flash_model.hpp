// SPDX-License-Identifier: MIT
#pragma once

/// Two sectors of flash in memory; the power can be cut at any write or erasure.

#include "boards/common/hardware.hpp"
#include "support/catch.hpp"

namespace cbcan::test {

struct PowerCut {};

/// How far the operation had progressed at the power cut.
enum class Cut { kBefore, kHalfWay, kAfter };

struct FlashModel final : boards::Flash {
  explicit FlashModel(std::size_t words) : sectors(2, std::vector<std::uint32_t>(words, 0x5555AAAA)) {}

  std::span<const std::uint32_t> sector(std::size_t number) const override { return sectors.at(number); }
  bool write(std::size_t sector, std::size_t word, std::uint32_t value) override {
    std::uint32_t& place = sectors.at(sector).at(word);
    if (place != kErased) FAIL("word " << word << " of sector " << sector << " is written twice");
    if (defective) return false;
    operate([&] { place = value | 0x00FF00FF; }, [&] { place = value; });
    return true;
  }
  bool erase(std::size_t sector) override {
    auto& words = sectors.at(sector);
    const auto half = words.begin() + static_cast<std::ptrdiff_t>(words.size() / 2);
    ++erasures;
    operate([&] { std::fill(words.begin(), half, kErased); }, [&] { std::ranges::fill(words, kErased); });
    return !defective;
  }

  std::vector<std::vector<std::uint32_t>> sectors;
  bool defective = false;
  std::size_t erasures = 0;
  std::size_t operations = 0;
  std::size_t cut_at = SIZE_MAX;  ///< the number of the operation, from 0
  Cut cut = Cut::kBefore;

 private:
  template <class Half, class Whole>
  void operate(Half half, Whole whole) {
    const bool cut_now = operations++ == cut_at;
    if (cut_now && cut == Cut::kHalfWay) half();
    if (!cut_now || cut == Cut::kAfter) whole();
    if (cut_now) throw PowerCut();
  }
};

}  // namespace cbcan::test
