// SPDX-License-Identifier: MIT
// Moments as text, which of them are tried, and what the table says.
#include "explored.hpp"

namespace cbcan::search::test {

namespace {

using Texts = std::vector<std::string>;

config::Config demo() {
  return scenario_of("[[step]]\n").config;
}

std::string error_of(const std::string& moments) {
  config::Config plant = demo();
  return cbcan::test::complaint_of<base::UsageError>([&] { parse_moments(moments, plant); });
}

Moments moments(const std::string& text) {
  config::Config plant = demo();
  return parse_moments(text, plant);
}

Texts texts(const std::vector<Moments>& all) {
  Texts found;
  for (const Moments& each : all)
    found.push_back(to_string(each));
  return found;
}

/// A record of transactions with one matching frame each, of one variant.
Record record_of(const Texts& transactions) {
  Record record;
  for (const std::string& text : transactions)
    record.transactions.push_back({text, "", {static_cast<std::uint32_t>(record.transactions.size() + 1)}});
  record.matches = {static_cast<std::uint32_t>(transactions.size())};
  return record;
}

Result ended(Verdict verdict, const std::string& what = "", const std::string& during = "") {
  Result result;
  result.verdict = verdict;
  result.what = what;
  result.during = during;
  result.happened = true;
  return result;
}

}  // namespace

TEST_CASE("moments: text and back") {
  for (const std::string text :
       {"16:response-never@149", "66:silent count=0@12", "bus:frame-loss first_id=0x580@1",
        "plc:plc-restart@7", "66:power for_ms=300@4+66:bus-off@5", "16:slow",
        "16:response-late delay_ms=1500@4294967295", "all:typical+16:silent@3"})
    CHECK(to_string(moments(text)) == text);
  CHECK(to_string(moments("16:silent")) == "16:silent@1");  // the same moment
  CHECK(moments("16:silent@3")[0].variant().fault.count == 1);
  CHECK(moments("16:silent count=2@3")[0].variant().fault.count == 2);
  CHECK(error_of("silent@3") == "silent@3: must be PLACE:FAULT@NUMBER, such as 16:response-never@149");
  CHECK(error_of("16:silent@x") == "16:silent@x: must be PLACE:FAULT@NUMBER, such as 16:response-never@149");
  CHECK(error_of("17:silent@1") == "17: there is no such node in the plant");
  CHECK(error_of("plc:silent@1").starts_with("silent: "));
  CHECK(error_of("16:sillent@1").find("did you mean silent?") != std::string::npos);
}

TEST_CASE("moments: as faults of the plant") {
  config::Config plant = demo();
  inject(parse_moments("16:silent@3+plc:cut@1+bus:frame-loss@2", plant), plant);
  const auto set_at = [&plant](std::string_view place) {
    return sim::text_of(config::faults_at(plant.networks[0], place)->faults->back().fault, false);
  };
  CHECK(set_at("16") == "silent after=2 count=1");
  CHECK(set_at("plc") == "cut count=1");
  CHECK(set_at("bus") == "frame-loss after=1 count=1");
}

TEST_CASE("variants: of all places, with a star") {
  Texts found;
  for (const Variant& variant : variants_of("c*", {"16", "66"}, 1))
    found.push_back(to_string(variant));
  CHECK(found == Texts{"plc:cut", "plc:cut-before"});
  found.clear();
  for (const Variant& variant : variants_of("power for_ms=300", {"16", "66"}, 2))
    found.push_back(to_string(variant));
  CHECK(found == Texts{"2/16:power for_ms=300", "2/66:power for_ms=300"});
  CHECK_THROWS_AS(variants_of("sillent", {"16"}, 1), base::UsageError);
}

TEST_CASE("groups: of alike transactions the first, the last and halvings between them") {
  const Variant variant = moments("16:silent@1")[0].variant();
  const auto tried = [&](const Texts& transactions) {
    return texts(moments_of({variant}, record_of(transactions))[0]);
  };
  CHECK(tried({"a", "b", "c"}) == Texts{"16:silent@1", "16:silent@3", "16:silent@2"});
  Texts group(16, "a");  // the 16th, 8th, 4th, 2nd and 1st from both ends
  std::ranges::sort(group);
  Texts sorted = tried(group);
  std::ranges::sort(sorted);
  CHECK(sorted == Texts{"16:silent@1", "16:silent@13", "16:silent@15", "16:silent@16", "16:silent@2",
                        "16:silent@4", "16:silent@8", "16:silent@9"});
}

TEST_CASE("order: round robin over the lists, and each beginning of a list is even") {
  CHECK(texts(round_robin({{moments("16:silent@1"), moments("16:silent@2")}, {moments("66:silent@1")}})) ==
        Texts{"16:silent@1", "66:silent@1", "16:silent@2"});
  const Variant variant = moments("16:silent@1")[0].variant();
  CHECK(texts(moments_of({variant}, record_of({"a", "b", "c", "d", "e"}))[0]) ==
        Texts{"16:silent@1", "16:silent@5", "16:silent@3", "16:silent@2", "16:silent@4"});
}

TEST_CASE("parts: each moment is in one of them") {
  for (unsigned number = 1; number <= 50; ++number) {
    const Moments each = moments("16:silent@" + std::to_string(number));
    CHECK(is_in_part(each, 1, 3) + is_in_part(each, 2, 3) + is_in_part(each, 3, 3) == 1);
  }
}

TEST_CASE("pairs: of alike ones the earliest") {
  Pairs pairs;
  pairs.add({{"x", moments("16:silent@5+16:silent@6")}, {"x", moments("16:silent@1+16:silent@3")}});
  pairs.add({{"x", moments("16:silent@1+16:silent@2")}, {"y", moments("16:silent@7+16:silent@8")}});
  Texts found = texts(pairs.take());
  std::ranges::sort(found);
  CHECK(found == Texts{"16:silent@1+16:silent@2", "16:silent@7+16:silent@8"});
}

TEST_CASE("results: a condition in a transaction is one failure, the simplest and earliest") {
  Results results;
  results.add("", 0, moments("16:silent@9"), ended(Verdict::kBroken, "always a", "read"));
  results.add("", 1, moments("16:silent@4"), ended(Verdict::kBroken, "always a", "read"));
  results.add("", 2, moments("16:silent@1+16:silent@2"), ended(Verdict::kBroken, "always a", "read"));
  results.add("", 3, moments("16:silent@7"), ended(Verdict::kBroken, "always a", "write"));
  results.add("", 4, moments("16:silent@2"), ended(Verdict::kDone));
  results.add("other", 5, moments("16:silent@1"), ended(Verdict::kBroken, "always a", "read"));
  const std::vector<Failure> failures = results.failures("");
  REQUIRE(failures.size() == 2);
  CHECK(to_string(failures[0].moments) == "16:silent@4");
  CHECK(failures[0].count == 3);
  CHECK(to_string(failures[1].moments) == "16:silent@7");
  CHECK(results.broken() == 5);
}

TEST_CASE("results: the table, in the order of kinds whatever the order of runs") {
  Results results;
  results.add("", 3, moments("66:silent@1"), ended(Verdict::kGaveUp));
  results.add("", 1, moments("16:silent@9"), ended(Verdict::kBroken, "always a", "read"));
  results.add("", 2, moments("16:silent@3"), ended(Verdict::kLate));
  results.add("", 0, moments("16:refuse@1"), {});
  results.add_unmatched(moments("16:response-other-crc@1")[0].variant());
  CHECK(
      results.table() ==
      "fault                               place   tried    done gave up  broken    late\n"
      "refuse                                 16       1       1       0       0       0, never happened 1\n"
      "response-other-crc                     16       0 no frame for it\n"
      "silent                                 16       2       0       0       1       1\n"
      "silent                                 66       1       0       1       0       0\n");
}

TEST_CASE("results: JUnit, where nothing was shown, and an error") {
  Results results;
  results.add("", 0, moments("16:silent@1"), ended(Verdict::kDone));
  results.add("", 1, moments("16:refuse@1"), {});  // never happened
  results.add("", 2, moments("16:slow"), {});      // from power-on
  results.add_unmatched(moments("16:abort@1")[0].variant());
  const std::string xml = results.junit(0, "killed");
  CHECK(xml.find("tests=\"5\" failures=\"0\" errors=\"1\" skipped=\"2\"") != std::string::npos);
  CHECK(xml.find("<error message=\"killed\">") != std::string::npos);
  CHECK(results.happened(""));
  CHECK(!has_happened(moments("16:refuse@1"), {}));
}

TEST_CASE("settings: survive is for one fault that passes") {
  const scenario::Scenario scenario =
      scenario_of("[explore]\nsurvive = [\"silent\", \"power\", \"slow\"]\n[[step]]\n");
  const Settings settings = read_settings(scenario.text, scenario.file);
  struct Nothing final : Runner {
    void run_all(std::size_t, const Make&, const Wanted&, const Ended&) override {}
  } runner;
  const Exploration exploration(scenario.config, settings, runner, {}, {});
  const auto survives = [&](const std::string& text) {
    return exploration.trial_of(moments(text), false).must_survive;
  };
  CHECK(survives("16:silent@1"));
  CHECK(!survives("16:silent count=0@1"));
  CHECK(!survives("16:silent@1+16:silent@2"));
  CHECK(survives("16:power for_ms=300@1"));
  CHECK(!survives("16:power@1"));
  CHECK(survives("16:slow"));
  CHECK(!survives("16:refuse@1"));
}

}  // namespace cbcan::search::test
