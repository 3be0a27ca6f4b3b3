// SPDX-License-Identifier: MIT
// Each rule of rules.hpp, broken once: by a fault that it is not told of, or by another node that does what a
// wrong module would.
#include "explored.hpp"

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

TEST_CASE("Judge: a read gives what the node has") {
  CHECK(wrong_with(std::string("[[step]]\n") + kRead1000).empty());
  // 1000h is 000F0191h; the first bit of the data is inverted on its way.
  CHECK(wrong_with(
            std::string("[can]\nfaults = [{ kind = \"frame-corrupt\", part = \"data\", first_id = 0x5C2, "
                        "last_id = 0x5C2, seed = 4 }]\n[[step]]\n") +
            kRead1000)
            .starts_with("what is read is in the node: it was not: "));
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
  CHECK(wrong_with(write).empty());
  const std::string corrupt =
      "[can]\nfaults = [{ kind = \"frame-corrupt\", part = \"data\", first_id = 0x610, last_id = 0x610, seed "
      "= 4 }]\n";
  const TrialReport baseline = judged(corrupt + write, nullptr);
  CHECK(baseline.record.changing == std::set<Object>{{1, 16, 0x6081, 0}});
  CHECK(wrong_with(corrupt + write).starts_with("what is written is in the node: it is not: 01 00 00 00"));
  CHECK(judged(corrupt + write, &baseline.record).result.verdict == Verdict::kDone);
}

TEST_CASE("Judge: a value that is gone after a boot-up is no failure") {
  const std::string write = R"(do = "trigger write 66 0x1017 0 2 100"
)";
  CHECK(wrong_with("[[step]]\n" + write).empty());
  // The node loses its power with its response, and comes back before the steps go on.
  CHECK(
      wrong_with("[[step]]\ndo = \"fault 66 power after=2 count=1 for_ms=300\"\n[[step]]\nafter = \"1s\"\n" +
                 write + "[[step]]\nafter = \"1s\"\n")
          .empty());
}

TEST_CASE("Judge: a node gets no download that was not requested") {
  const std::string other = "[[step]]\ndo = \"send 642#2F00620101000000\"\nafter = \"1s\"\n";
  CHECK(wrong_with(other) == "each download has been requested: node 66 got one more of 6200h:1");
  const TrialReport baseline = judged(other, nullptr);
  CHECK(baseline.record.unrequested == std::set<Object>{{1, 66, 0x6200, 1}});
  CHECK(judged(other, &baseline.record).result.verdict == Verdict::kDone);
}

TEST_CASE("Judge: a node that has not responded in time is left alone") {
  const std::string timeout = R"([[step]]
do = ["fault 66 request-lost count=1", "trigger read 66 0x1000 0 4"]
wait = "transaction ended"
expect = "took = 1s"
)";
  const std::string request = "do = \"send 642#4018100100000000\"\n";
  const std::string message = "a node that has not responded in time is left alone: 66 has a request";
  CHECK(wrong_with(timeout + "[[step]]\nafter = \"899ms\"\n" + request) == message);
  CHECK(wrong_with(timeout + "[[step]]\nafter = \"1s\"\n" + request).empty());
  CHECK(wrong_with(timeout + "[[step]]\ndo = \"send 5C2#4300100091010F00\"\n[[step]]\n" + request).empty());
  CHECK(wrong_with(timeout + "[[step]]\ndo = \"send 742#00\"\n[[step]]\n" + request).empty());
}

TEST_CASE("Judge: the own node leaves Operational when the PLC is silent") {
  const std::string plant = "[module]\nplc_timeout_ms = 500\nnode_id = 127\n";
  CHECK(wrong_with(plant + "[[step]]\ndo = [\"write 3700 0\", \"nmt start all\"]\n[[step]]\nafter = \"3s\"\n")
            .empty());
  // Another node starts it at the same time: as if it had not stopped.
  CHECK(
      wrong_with(
          plant +
          "[[step]]\nat = \"1ms\"\ndo = \"write 3700 0\"\n[[step]]\nat = \"501ms\"\ndo = \"nmt start all\"\n"
          "[[step]]\nafter = \"1us\"\n") ==
      "the own node stops when the PLC is silent: it is Operational after plc_timeout_ms");
}

TEST_CASE("Judge: a transaction does not end well if its response was wrong") {
  // Faults act one after the other: the second replaces the abort of the first by a good response of another
  // node.
  const std::string steps = R"([[step]]
do = ["fault 66 silent", "fault 66 abort", "trigger read 66 0x1000 0 4", "send 5C2#4300100091010F00"]
wait = "transaction ended"
)";
  CHECK(wrong_with(steps).empty());  // silent is first: there is nothing left to replace
  CHECK(
      wrong_with(
          "[[step]]\ndo = [\"fault 66 abort\", \"fault bus frame-loss count=1 first_id=0x5C2 "
          "last_id=0x5C2\", "
          "\"trigger read 66 0x1000 0 4\", \"send 5C2#4300100091010F00\"]\nwait = \"transaction ended\"\n") ==
      "a wrong response is noticed: result 0");
}

TEST_CASE("Judge: no event is missed while the plant settles with more frames than the journal holds") {
  // A read that ends 2 s after the last step, with a wrong value; 20,000 frames of a busy bus follow.
  const std::string steps =
      "[can]\nfaults = [{ kind = \"frame-corrupt\", part = \"data\", first_id = 0x5C2, last_id = 0x5C2, "
      "seed = 4 }]\n[module]\nsdo_timeout_ms = 5000\n[[step]]\ndo = [\"fault 66 response-late delay_ms=2000\", "
      "\"fault bus bus-load frames_per_s=5000\", \"trigger read 66 0x1000 0 4\"]\n";
  CHECK(wrong_with(steps).starts_with("what is read is in the node: it was not: "));
}

TEST_CASE("Judge: conditions") {
  const auto with = [](const std::string& conditions) {
    return wrong_with("[explore]\n" + conditions + "\n[[step]]\n" + kRead1000);
  };
  CHECK(with("always = \"object 66 0x1000 = 983441\"").empty());
  CHECK(with("always = \"object 66 0x1000 = 1\"") == "always object 66 0x1000 = 1: it is 983441");
  CHECK(with("done = \"object 66 0x1000 = 1\"") == "done object 66 0x1000 = 1: it is 983441");
  CHECK(with("gave_up = \"object 66 0x1000 = 1\"").empty());
  CHECK(wrong_with(
            "[explore]\nalways = \"object 66 0x1000 = 983441\"\n[[step]]\ndo = \"power 66 off\"\nafter = "
            "\"1s\"\n")
            .empty());
  CHECK(wrong_with("[explore]\nwithin = \"2s\"\n[[step]]\nafter = \"2001ms\"\n") ==
        "the program ends: not within 2.000000 s");
  CHECK(wrong_with("[explore]\nwithin = \"2s\"\n[[step]]\nafter = \"2s\"\n").empty());
  CHECK(wrong_with("[explore]\nsettle = \"10s\"\ndone = \"state 66 pre-operational\"\n[[step]]\ndo = \"nmt "
                   "start 66\"\n") == "done state 66 pre-operational: it is operational");
}

TEST_CASE("Judge: a mistake in a condition is one of the file") {
  const auto wrong = [](const std::string& condition) {
    try {
      wrong_with("[explore]\n" + condition + "\n[[step]]\n" + kRead1000);
    } catch (const base::UsageError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(wrong("always = [\"object 66 0x1000 > 0\",\n \"object 66 0x1000 >= 6O\"]") ==
        "s.toml:4: \"6O\": must be a number, as the object is one");
  CHECK(wrong("reached = \"register 3700 = 0 within 5s\"") ==
        "s.toml:3: register 3700 = 0 within 5s: within is a key of its own; write within = \"5s\"");
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
  CHECK(report(result) == "w: s \n  in: read\n  last request: FC6\n  | not found\n  0.1 f\n");
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
