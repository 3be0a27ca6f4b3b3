// SPDX-License-Identifier: MIT
// The lines of --state: what they are, and what is no such line.
#include "scenario/search/state.hpp"
#include "explored.hpp"

namespace cbcan::search::test {

namespace {

const std::string kSubject = R"(["","0123456789abcdef"])"
                             "\n";

std::string line_with(const std::string& moments, const std::string& verdict) {
  return R"([")" + moments +
         R"(",{"disturbed":"","duration":5,"during":"read","frames":"","happened":true,"reached":[true,false],"request":"FC6",)"
         R"("said":"","seen":"it is 1","verdict":)" +
         verdict +
         R"(,"what":"always a"}])"
         "\n";
}

std::string problem_in(const std::string& text) {
  return cbcan::test::complaint_of<base::UsageError>([&] { parse_state(text, "f"); });
}

}  // namespace

TEST_CASE("state: a line is a moment and its result") {
  const std::string line = line_with("16:silent count=0@3+66:power@4", "2");
  const State state = parse_state(kSubject + line, "f");
  REQUIRE(state.size() == 1);
  CHECK(state.at("").fingerprint == "0123456789abcdef");
  REQUIRE(state.at("").runs.size() == 1);
  const auto& [moments, result] = *state.at("").runs.begin();
  CHECK(moments == "16:silent count=0@3+66:power@4");
  CHECK(result.verdict == Verdict::kBroken);
  CHECK(result.what == "always a");
  CHECK(result.seen == "it is 1");
  CHECK(result.reached == std::vector<bool>{true, false});
  CHECK(result.duration == 5);
  CHECK(state_line("", "0123456789abcdef") + state_line(moments, result) == kSubject + line);
  CHECK(parse_state("", "f").empty());
}

TEST_CASE("state: what is damaged is named by its line") {
  const std::string good = kSubject + line_with("16:silent@3", "3");
  CHECK(problem_in(good).empty());
  for (const char* verdict : {"4", "77", "-1", "1.5", "\"2\"", "null", "18446744073709551615", "1e99"})
    CHECK(problem_in(good + line_with("16:silent@3", verdict)) ==
          "f:3: is no result of this version; remove the line");
  for (const char* moments : {"16", "16:silent@x", "16:silent@4294967296", "16:silent@3+"})
    CHECK(problem_in(good + line_with(moments, "0")).empty() == (std::string(moments) == "16:silent@3+"));
  for (const char* line :
       {"", "{}", "[]", R"(["16:silent@3"])", R"(["16:silent@3",{}])", R"(["16:silent@3",7])",
        R"(["16:silent@3",{"verdict":0}])", "[[[[[[", "\xFF", R"([5,"x"])"})
    CHECK(problem_in(good + line + "\n") == "f:3: is no result of this version; remove the line");
  CHECK(problem_in("plant = \"demo\"\n") == "f:1: is no file of --explore; name a new one");
  CHECK(problem_in(line_with("16:silent@3", "0")) == "f:1: is no file of --explore; name a new one");
  std::string negative = good;
  negative.replace(negative.find(":5,"), 3, ":-5,");
  CHECK(problem_in(negative) == "f:2: is no result of this version; remove the line");
}

TEST_CASE("state: joined texts are one, unless they are about different programs") {
  const std::string other = "[\"s.toml\",\"fedcba9876543210\"]\n" + line_with("66:abort@1", "0");
  const State state = parse_state(kSubject + line_with("16:silent@3", "0") + other + kSubject +
                                      line_with("16:silent@4", "1") + line_with("16:silent@3", "2"),
                                  "f");
  REQUIRE(state.size() == 2);
  CHECK(state.at("s.toml").runs.size() == 1);
  CHECK(state.at("").runs.size() == 2);
  CHECK(state.at("").runs.at("16:silent@3").verdict == Verdict::kBroken);  // the later one
  CHECK(problem_in(kSubject + "[\"\",\"1\"]\n") ==
        "f:2: results of another program, plant, command or version; keep them apart");
}

}  // namespace cbcan::search::test
