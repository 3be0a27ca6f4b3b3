// SPDX-License-Identifier: MIT
#include "config/plant_settings.hpp"

#include "support/catch.hpp"

using namespace cbcan::config;
using cbcan::base::assign;
using cbcan::base::Form;
using cbcan::base::typed;

namespace {

template <class Target>
void check_defaults(std::span<const Setting<Target>> rows) {
  for (const auto& row : rows) {
    const std::string standard = standard_of(row);
    if (standard == kNone || standard == row.absent) continue;
    INFO(row.key);
    Target target;
    CHECK(assign(row, target, typed(row, standard)) == "");
    CHECK(target == Target{});
  }
}

template <class Target>
void check_ranges(std::span<const Setting<Target>> rows) {
  for (const auto& row : rows) {
    if (row.form != Form::kInteger) continue;
    INFO(row.key);
    Target target;
    for (const std::int64_t number : row.numbers)
      CHECK(assign(row, target, number) == "");
    const std::int64_t low = row.numbers.empty() ? row.low : row.numbers.front();
    const std::int64_t high = row.numbers.empty() ? row.high : row.numbers.back();
    CHECK(assign(row, target, low) == "");
    CHECK(assign(row, target, high) == "");
    const Target before = target;
    CHECK(assign(row, target, low - 1) != "");
    CHECK(assign(row, target, high + 1) != "");
    CHECK(target == before);
  }
}

template <class Target>
void check_own(std::span<const Setting<Target>> rows) {
  const std::map<Form, std::string> other{{Form::kInteger, "10001"},
                                          {Form::kBoolean, "true"},
                                          {Form::kText, "socketcan:x"},
                                          {Form::kPath, "x"},
                                          {Form::kAddress, "unix:x"}};
  std::vector<Target> changed;
  for (const auto& row : rows) {
    INFO(row.key);
    Target target;
    const bool is_small = row.form == Form::kInteger && row.high < 10'001;
    std::string text = is_small ? std::to_string(row.high - 1) : other.at(row.form);
    if (!row.choices.empty()) text = row.choices.back();
    if (row.key == "module.enabled") text = "false";
    if (!row.numbers.empty()) text = std::to_string(row.numbers.back());
    if (row.key == "plc.address" || row.key == "http.listen") text = "x:1";
    REQUIRE(assign(row, target, typed(row, text)) == "");
    CHECK(target != Target{});
    CHECK(std::ranges::find(changed, target) == changed.end());
    changed.push_back(target);
  }
}

}  // namespace

TEST_CASE("the defaults in the help are those of the structs") {
  check_defaults(kPlantSettings);
  check_defaults(kNetworkSettings);
}

TEST_CASE("both ends of each range are taken, what is beyond is not") {
  check_ranges(kPlantSettings);
  check_ranges(kNetworkSettings);
}

TEST_CASE("every setting changes something of its own") {
  check_own(kPlantSettings);
  check_own(kNetworkSettings);
}

TEST_CASE("every name in a plant file, each once") {
  const auto keys = plant_keys();
  CHECK(std::set(keys.begin(), keys.end()).size() == keys.size());
  CHECK(std::ranges::count(keys, "node.objects") == 1);
  CHECK(std::ranges::count(keys, "can.bit_rate") == 1);
}
