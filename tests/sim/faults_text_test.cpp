// SPDX-License-Identifier: MIT
// Faults as text and as keys and values; the lines of docs/reference/faults.md are such texts.

#include "sim/faulty_plant.hpp"
#include "support/case_file.hpp"

using namespace cbcan::sim;
using namespace cbcan;
using namespace cbcan::test;

namespace {

std::string problem_of(const std::string& text, FaultPlace here = FaultPlace::kNode) {
  return parse_fault(text, here).problem;
}

}  // namespace

TEST_CASE("A fault from text: what is given, and defaults for the rest") {
  const Fault fault = fault_from(
      "response-late delay_ms=50 index=0x2001 sub=1 step=block-segment after=3 count=1 probability=0.5 "
      "from_ms=10 until_ms=20 seed=7",
      FaultPlace::kNode);
  CHECK(fault.kind == FaultKind::kResponseLate);
  CHECK(fault.delay == 50 * kMillisecond);
  CHECK(fault.index == 0x2001);
  CHECK(fault.sub == 1);
  CHECK(fault.step == SdoStep::kBlockSegment);
  CHECK(fault.after == 3);
  CHECK(fault.count == 1);
  CHECK(fault.probability == 0.5);
  CHECK(fault.from == 10 * kMillisecond);
  CHECK(fault.until == 20 * kMillisecond);
  CHECK(fault.seed == 7);

  CHECK(fault_from("refuse", FaultPlace::kNode).code == 0x08000020);
  const Fault plain = fault_from("  abort\t", FaultPlace::kNode);
  CHECK(plain.kind == FaultKind::kAbort);
  CHECK(plain.code == 0x08000000);
  CHECK(plain.index == Fault::kUnset);
  CHECK(plain.sub == Fault::kUnset);
  CHECK(plain.step == SdoStep::kAny);
  CHECK(plain.after == 0);
  CHECK(plain.count == 0);
  CHECK(plain.probability == 1);
  CHECK(plain.from == 0);
  CHECK(plain.until == kNever);
  CHECK(fault_from("frame-loss", FaultPlace::kBus).last_id == 0x1FFFFFFF);
  CHECK(fault_from("abort code=0xFFFFFFFF", FaultPlace::kNode).code == 0xFFFFFFFF);
  CHECK(fault_from("frame-loss probability=1", FaultPlace::kBus).probability == 1);
}

TEST_CASE("A fault from the keys and values of a plant file") {
  const std::vector<FaultKey> keys{{"delay_ms", std::int64_t{50}},
                                   {"index", std::int64_t{0x2001}},
                                   {"step", std::string("initiate")},
                                   {"probability", 0.25}};
  const FaultOrProblem made = make_fault("response-late", keys, FaultPlace::kNode);
  CHECK(made.problem.empty());
  CHECK(text_of(made.fault) == "response-late delay_ms=50 probability=0.25 index=0x2001 step=initiate");
  const std::vector<FaultKey> wrong{{"index", std::string("0x2001")}};
  CHECK(make_fault("response-late", wrong, FaultPlace::kNode).problem ==
        "response-late: index \"0x2001\": must be an integer, 0x0000..0xFFFF");
}

TEST_CASE("Every kind has a text that makes it again") {
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    const FaultRow& row = fault_rows()[kind];
    INFO(row.name);
    const FaultPlace here = row.place == FaultPlace::kNodeOrBus ? FaultPlace::kNode : row.place;
    const Fault fault = fault_from(std::string(row.name), here);
    CHECK(fault.kind == static_cast<FaultKind>(kind));
    CHECK(text_of(fault_from(text_of(fault), here)) == text_of(fault));
    CHECK(problem_of(std::string(row.name) + " until_ms=5", here).empty());
  }
  CHECK(text_of(fault_from("bus-load percent=7 until_ms=5", FaultPlace::kBus)) ==
        "bus-load percent=7 frames_per_s=0 id=0x7FF until_ms=5");
  CHECK(text_of(fault_from("response-twice probability=0.1", FaultPlace::kNode)) ==
        "response-twice delay_ms=0 probability=0.1");
}

TEST_CASE("Every key takes its lowest and highest value and none beyond") {
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    const FaultRow& row = fault_rows()[kind];
    const FaultPlace here = row.place == FaultPlace::kNodeOrBus ? FaultPlace::kNode : row.place;
    for (const base::Setting<Fault>* setting : keys_of(row)) {
      const base::Setting<Fault>& key = *setting;
      if (!key.choices.empty()) continue;
      INFO(row.name << " " << key.key);
      const auto with = [&](std::int64_t value) {
        const std::vector<FaultKey> keys{{key.key, value}};
        return make_fault(row.name, keys, here).problem;
      };
      CHECK((with(key.low).empty() || key.key == "sub" || key.key == "until_ms"));
      if (key.key != "sub" && key.key != "first_id" && key.key != "from_ms") CHECK(with(key.high).empty());
      const std::string must = std::string(row.name) + ": " + std::string(key.key);
      for (const std::int64_t beyond : {key.low - 1, key.high + 1}) {
        CHECK(with(beyond).starts_with(must));
        CHECK(with(beyond).ends_with(": must be " + domain_of(key)));
      }
    }
  }
}

TEST_CASE("Each fault of the table is reported with its key and the permitted values") {
  for (const FileCase& each : cases_of("tests/sim/fault_mistakes.txt")) {
    const std::string& line = each.given.at(0);
    const FaultPlace here = line.starts_with("bus") ? FaultPlace::kBus : FaultPlace::kNode;
    each.check({problem_of(line.substr(std::min(line.size(), line.find(' '))), here)});
  }
}

TEST_CASE("The run-time lines of docs/reference/faults.md are good faults") {
  unsigned lines = 0;
  for (const std::string& line : lines_of(source_file("docs/reference/faults.md"))) {
    const auto at = line.find("    fault ");
    if (at != 0) continue;
    std::istringstream words(line);
    std::string fault, whose;
    words >> fault >> whose;
    std::string rest;
    std::getline(words, rest);
    INFO(line);
    const FaultPlace here = whose == "bus"   ? FaultPlace::kBus
                            : whose == "plc" ? FaultPlace::kPlc
                                             : FaultPlace::kNode;
    CHECK(problem_of(rest, here).empty());
    ++lines;
  }
  CHECK(lines >= 5);
}
