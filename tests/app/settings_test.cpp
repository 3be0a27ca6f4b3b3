// SPDX-License-Identifier: MIT
#include "app/settings.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "app/suggest.hpp"
#include "support/catch.hpp"

using namespace cbcan::app;

TEST_CASE("the defaults of the table are the defaults of the structs") {
  for (const auto& row : settings()) {
    if (row.standard.empty()) continue;
    INFO(row.key);
    Config config;
    CHECK(assign(row, config, parse_value(row.standard)) == "");
    CHECK(config == Config{});
  }
}

TEST_CASE("both ends of each range are taken, what is beyond is not") {
  for (const auto& row : settings()) {
    if (row.type != SettingType::kInteger) continue;
    INFO(row.key);
    Config config;
    CHECK(assign(row, config, row.low) == "");
    CHECK(assign(row, config, row.high) == "");
    const Config before = config;
    CHECK(assign(row, config, row.low - 1) != "");
    CHECK(assign(row, config, row.high + 1) != "");
    CHECK(config == before);
  }
}

TEST_CASE("every setting changes something of its own") {
  const std::map<SettingType, std::string> other{
      {SettingType::kInteger, "10001"}, {SettingType::kBoolean, "true"},
      {SettingType::kChoice, "manual"}, {SettingType::kText, "socketcan:x"},
      {SettingType::kPath, "x"},        {SettingType::kAddress, "unix:x"}};
  std::vector<Config> changed;
  for (const auto& row : settings()) {
    INFO(row.key);
    Config config;
    std::string text = row.high == 127 ? "77" : other.at(row.type);
    if (row.key == "module.enabled") text = "false";
    REQUIRE(assign(row, config, parse_value(text)) == "");
    CHECK(config != Config{});
    CHECK(std::ranges::find(changed, config) == changed.end());
    changed.push_back(config);
  }
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
