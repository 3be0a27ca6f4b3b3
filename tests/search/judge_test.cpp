// SPDX-License-Identifier: MIT
// Each rule of rules.hpp, broken once; most of them: judged.txt.
#include "explored.hpp"
#include "support/case_file.hpp"

namespace cbcan::search::test {

namespace {

constexpr const char* kRead1000 = R"(do = "trigger read 66 0x1000 0 4"
wait = "transaction ended"
)";

/// What is wrong with these steps, in a run after one that nothing is known about; "" = nothing.
std::string wrong_with(const std::string& steps) {
  const Record nothing;
  const Result result = judged(steps, &nothing).result;
  CHECK(result.verdict == (result.what.empty() ? Verdict::kDone : Verdict::kBroken));
  return result.what.empty() ? "" : result.what + ": " + result.seen;
}

}  // namespace

TEST_CASE("Judge: what is wrong with the steps of the table, and what is not") {
  for (const cbcan::test::FileCase& each : cbcan::test::cases_of("tests/search/judged.txt"))
    each.check(cbcan::test::lines_of(wrong_with(each.text())));
}

TEST_CASE("Judge: a fault that changes values suspends that") {
  const Record nothing;
  const std::string steps =
      std::string("[[step]]\ndo = \"fault 66 duplicate-node-id\"\n[[step]]\n") + kRead1000;
  CHECK(judged(steps, &nothing, true).result.verdict == Verdict::kDone);
}

TEST_CASE("Judge: a write with result 0 is in the node, except for objects that change at once") {
  const std::string write = R"([[step]]
do = "trigger write 16 0x6081 0 4 1 0"
wait = "transaction ended"
)";
  const std::string corrupt =
      "[can]\nfaults = [{ kind = \"frame-corrupt\", part = \"data\", first_id = 0x610, last_id = 0x610, seed "
      "= 4 }]\n";
  const TrialReport baseline = judged(corrupt + write, nullptr);
  CHECK(baseline.record.changing == std::set<Object>{{1, 16, 0x6081, 0}});
  CHECK(judged(corrupt + write, &baseline.record).result.verdict == Verdict::kDone);
}

TEST_CASE("Judge: a node gets no download that was not requested") {
  const std::string other = "[[step]]\ndo = \"send 642#2F00620101000000\"\nafter = \"1s\"\n";
  const TrialReport baseline = judged(other, nullptr);
  CHECK(baseline.record.unrequested == std::set<Object>{{1, 66, 0x6200, 1}});
  CHECK(judged(other, &baseline.record).result.verdict == Verdict::kDone);
}

TEST_CASE("Judge: a mistake in a condition is one of the file") {
  const auto wrong = [](const std::string& condition) {
    return cbcan::test::complaint_of<base::UsageError>(
        [&] { wrong_with("[explore]\n" + condition + "\n[[step]]\n" + kRead1000); });
  };
  CHECK(wrong("always = [\"object 66 0x1000 > 0\",\n \"object 66 0x1000 >= 6O\"]") ==
        "s.toml:4: explore.always: \"6O\": must be a number, as the object is one");
  CHECK(wrong("reached = \"register 3700 = 0 within 5s\"") ==
        "s.toml:3: explore.reached: register 3700 = 0 within 5s: within is a key of its own; write within = "
        "\"5s\"");
}

TEST_CASE("Judge: the last Modbus request, and what a command has said") {
  Result result;
  result.what = "w";
  result.seen = "s\x1B";
  result.frames = "  0.1 f\n";
  CHECK(report(result) == "w: s \n  0.1 f\n");
  result.said = "  | not found\n";
  CHECK(report(result) == "w: s \n  | not found\n");  // it has done nothing: no frames
  result.during = "read";
  result.request = "FC6";
  result.disturbed = "FC16";
  CHECK(report(result) ==
        "w: s \n  in: read\n  fault in: FC16\n  last request: FC6\n  | not found\n  0.1 f\n");
}

TEST_CASE("Judge: at the end each node can be read that could without faults") {
  const std::string steps = std::string("[[step]]\n") + kRead1000;
  const TrialReport baseline = judged(steps, nullptr);
  CHECK(baseline.record.readable == std::set<std::string>{"66"});
  const std::string off = "[[step]]\ndo = \"fault 66 silent\"\n" + steps;
  CHECK(judged(off, &baseline.record).result.verdict == Verdict::kDone);  // faults are removed
  CHECK(judged(steps + "[[step]]\ndo = \"power 66 off\"\n", &baseline.record).result.verdict ==
        Verdict::kDone);
}

TEST_CASE("Judge: the record") {
  const Record record = judged(std::string("[[step]]\n") + kRead1000, nullptr).record;
  REQUIRE(record.transactions.size() == 0);  // nothing is counted
  CHECK(record.nodes == std::set<std::string>{"66"});
  REQUIRE(record.frames.size() >= 2);
  CHECK(record.frames[6] == "0.000000 642#4000100000000000");
  CHECK(record.frames[7] == "0.000000 5C2#4300100091010F00");
}

}  // namespace cbcan::search::test
