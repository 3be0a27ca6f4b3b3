// SPDX-License-Identifier: MIT
#include "app/settings.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "app/suggest.hpp"
#include "support/catch.hpp"

using namespace cbcan::app;

namespace {

template <class Target>
void check_defaults(std::span<const Setting<Target>> rows) {
  for (const auto& row : rows) {
    if (row.standard.empty()) continue;
    INFO(row.key);
    Target target;
    CHECK(assign(row, target, parse_value(row.standard)) == "");
    CHECK(target == Target{});
  }
}

template <class Target>
void check_ranges(std::span<const Setting<Target>> rows) {
  for (const auto& row : rows) {
    if (row.type != SettingType::kInteger) continue;
    INFO(row.key);
    Target target;
    CHECK(assign(row, target, row.low) == "");
    CHECK(assign(row, target, row.high) == "");
    const Target before = target;
    CHECK(assign(row, target, row.low - 1) != "");
    CHECK(assign(row, target, row.high + 1) != "");
    CHECK(target == before);
  }
}

template <class Target>
void check_own(std::span<const Setting<Target>> rows) {
  const std::map<SettingType, std::string> other{
      {SettingType::kInteger, "10001"}, {SettingType::kBoolean, "true"},
      {SettingType::kChoice, "manual"}, {SettingType::kText, "socketcan:x"},
      {SettingType::kPath, "x"},        {SettingType::kAddress, "unix:x"}};
  std::vector<Target> changed;
  for (const auto& row : rows) {
    INFO(row.key);
    Target target;
    const bool is_small = row.type == SettingType::kInteger && row.high < 10'001;
    std::string text = is_small ? std::to_string(row.high - 1) : other.at(row.type);
    if (row.key == "module.enabled") text = "false";
    if (row.key == "module.plc_lost_state") text = "stopped";
    REQUIRE(assign(row, target, parse_value(text)) == "");
    CHECK(target != Target{});
    CHECK(std::ranges::find(changed, target) == changed.end());
    changed.push_back(target);
  }
}

}  // namespace

TEST_CASE("the defaults of the table are the defaults of the structs") {
  check_defaults(settings());
  check_defaults(network_settings());
}

TEST_CASE("both ends of each range are taken, what is beyond is not") {
  check_ranges(settings());
  check_ranges(network_settings());
}

TEST_CASE("every setting changes something of its own") {
  check_own(settings());
  check_own(network_settings());
}

TEST_CASE("every name in a plant file, each once") {
  const auto keys = plant_keys();
  CHECK(std::set(keys.begin(), keys.end()).size() == keys.size());
  CHECK(std::ranges::count(keys, "node.objects") == 1);
  CHECK(std::ranges::count(keys, "can.bit_rate") == 1);
}

TEST_CASE("what somebody may have meant") {
  constexpr std::array<std::string_view, 5> kKnown{"can", "can.bit_rate", "can.spec", "log.file", "node.id"};
  CHECK(nearest("can.bit_rte", kKnown) == "can.bit_rate");
  CHECK(nearest("can.rate", kKnown) == "can.bit_rate");
  CHECK(nearest("can.spce", kKnown) == "can.spec");
  CHECK(nearest("can.sepc", kKnown) == "can.spec");
  CHECK(nearest("can.spcee", kKnown) == "");
  CHECK(nearest("can.file", kKnown) == "log.file");
  CHECK(nearest("cab", kKnown) == "can");
  CHECK(nearest("x", kKnown) == "");
  CHECK(nearest("", kKnown) == "");
  CHECK(nearest("can.", kKnown) == "");
}
