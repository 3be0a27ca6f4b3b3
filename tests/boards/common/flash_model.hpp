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
  explicit FlashModel(std::size_t words, std::size_t unit_words = 1)
      : sectors(2, std::vector<std::uint32_t>(words, 0x5555AAAA)), unit(unit_words) {}

  std::span<const std::uint32_t> sector(std::size_t number) const override { return sectors.at(number); }
  std::size_t unit_words() const override { return unit; }
  bool write(std::size_t sector, std::size_t word, std::span<const std::uint32_t> values) override {
    const auto place = std::span(sectors.at(sector)).subspan(word, unit);
    if (word % unit != 0 || values.size() != unit || !is_erased(place))
      FAIL("word " << word << " of sector " << sector << " is not an erased unit");
    const auto is_here = [&](const Torn& each) { return each.sector == sector && each.word == word; };
    if (defective || std::ranges::any_of(torn, is_here)) return false;
    operate(
        [&] {
          torn.push_back({sector, word, {values.begin(), values.end()}});
          read_torn([](std::uint32_t value) { return value | 0x00FF00FF; });
        },
        [&] { std::ranges::copy(values, place.begin()); });
    return true;
  }
  bool erase(std::size_t sector) override {
    auto& words = sectors.at(sector);
    const auto half = words.begin() + static_cast<std::ptrdiff_t>(words.size() / 2);
    ++erasures;
    std::erase_if(torn, [&](const Torn& each) { return each.sector == sector; });
    operate([&] { std::fill(words.begin(), half, kErased); }, [&] { std::ranges::fill(words, kErased); });
    return !defective;
  }

  std::vector<std::vector<std::uint32_t>> sectors;
  std::size_t unit;
  /// A unit whose write has been interrupted: it cannot be written, even if it reads as erased.
  struct Torn {
    std::size_t sector, word;
    std::vector<std::uint32_t> values;
  };
  std::vector<Torn> torn;
  /// What these read as from now on, made of the words that they should hold.
  void read_torn(auto reading) {
    for (const Torn& each : torn)
      std::ranges::transform(each.values,
                             sectors[each.sector].begin() + static_cast<std::ptrdiff_t>(each.word), reading);
  }
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
