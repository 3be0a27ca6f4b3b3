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
  const std::string text = kSubject + line;
  const State state = parse_state(text, "f");
  REQUIRE(state.size() == 1);
  CHECK(state.at("").fingerprint == "0123456789abcdef");
  REQUIRE(state.at("").lines.size() == 1);
  const KeptRun run = *run_in(state.at("").line("16:silent count=0@3+66:power@4"));
  const Result& result = run.result;
  CHECK(run.moments == "16:silent count=0@3+66:power@4");
  CHECK(result.verdict == Verdict::kBroken);
  CHECK(result.what == "always a");
  CHECK(result.seen == "it is 1");
  CHECK(result.reached == std::vector<bool>{true, false});
  CHECK(result.duration == 5);
  CHECK(state_line("", "0123456789abcdef") + state_line(run) == kSubject + line);
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
  const std::string text = kSubject + line_with("16:silent@3", "0") + other + kSubject +
                           line_with("16:silent@4", "1") + line_with("16:silent@3", "2");
  const State state = parse_state(text, "f");
  REQUIRE(state.size() == 2);
  CHECK(state.at("s.toml").has("66:abort@1"));
  CHECK(!state.at("s.toml").has("16:silent@3"));
  CHECK(state.at("").has("16:silent@4"));
  CHECK(run_in(state.at("").line("16:silent@3"))->result.verdict == Verdict::kBroken);  // the later one
}

TEST_CASE("state: joined texts of different sources are refused by the name of what differs") {
  const Sources sources{{"version", "0.2.0"}, {"plant", "a"}, {"command", "b"}};
  CHECK(fingerprint_of(sources) ==
        "version=0.2.0;plant=af63dc4c8601ec8c;command=af63df4c8601f1a5");  // FNV-1a
  const auto problem_with = [&](std::size_t place, const std::string& source) {
    Sources others = sources;
    others[place].second = source;
    return problem_in(state_line("s.toml", fingerprint_of(sources)) +
                      state_line("s.toml", fingerprint_of(others)));
  };
  CHECK(problem_with(0, "0.1.0") == "f:2: s.toml: results of version 0.1.0; keep them apart");
  CHECK(problem_with(1, "A") == "f:2: s.toml: results of another plant; keep them apart");
  CHECK(problem_with(2, "B") == "f:2: s.toml: results of another command; keep them apart");
  CHECK(problem_in(kSubject + "[\"\",\"1\"]\n") == "f:2: results of version 1; keep them apart");
}

TEST_CASE("state: a run with what pairs need of it") {
  KeptRun run{"16:silent@3", {}, Near{"0123", {{"read", "0A", {1, 2}}}}};
  const std::string line = state_line(run);
  const std::optional<KeptRun> read = run_in(line);
  REQUIRE((read && read->near));
  CHECK(read->near->variants == "0123");
  CHECK(read->near->transactions.at(0).matches == std::vector<std::uint32_t>{1, 2});
  CHECK(state_line(*read) == line);
}

}  // namespace cbcan::search::test
