// SPDX-License-Identifier: MIT
// Faults as text and as keys and values; the lines of docs/reference/faults.md are such texts.

#include "sim/faulty_plant.hpp"

using namespace cbcan::sim;
using namespace cbcan;
using namespace cbcan::test;

namespace {

std::string problem_of(const std::string& text, FaultPlace here = FaultPlace::kNode) {
  return parse_fault(text, here).problem;
}

std::string document() {
  std::ifstream file(CBCAN_SOURCE_DIR "/docs/reference/faults.md");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

Texts lines_of(const std::string& text) {
  std::istringstream stream(text);
  Texts lines;
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
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
  CHECK(problem_of("refuse code=0") == "refuse: code 0: must be 0x001..0xFFFFFFFF");
  CHECK_FALSE(problem_of("refuse step=initiate").empty());
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

TEST_CASE("Errors are reported with the key and the permitted values") {
  CHECK(problem_of("response-lat") == "fault \"response-lat\": no such kind; did you mean response-late?");
  CHECK(problem_of("response-lat after=1") == problem_of("response-lat"));
  CHECK(problem_of("nonsense") ==
        "fault \"nonsense\": no such kind; there are response-never, response-late, response-twice, "
        "response-out-of-order, response-other-toggle, response-other-specifier, response-other-index, "
        "response-other-size, response-other-crc, response-other-sequence, abort, short-frame, refuse, "
        "request-lost, "
        "silent, heartbeat-stops, state-wrong, duplicate-node-id, boot-up-storm, emcy-storm, power, bus-off, "
        "error-passive, overflow and slow");
  CHECK(problem_of("", FaultPlace::kBus) ==
        "fault \"\": no such kind; there are frame-loss, frame-twice, frame-late, frame-corrupt, module-nmt, "
        "bus-off, "
        "module-bus-off, error-passive, overflow and bus-load");
  CHECK(problem_of("frame-loss") == "frame-loss: a fault of the bus, not of a node");
  CHECK(problem_of("silent", FaultPlace::kBus) == "silent: a fault of a node, not of the bus");
  CHECK(problem_of("silent delay=5") ==
        "silent: delay: no such key; there are after, count, probability, seed, from_ms and until_ms");
  CHECK(problem_of("bus-off count=5") ==
        "bus-off: count: no such key; there are after, from_ms, until_ms and for_ms");
  CHECK(problem_of("slow after=5") == "slow: after: no such key; there are delay_ms, from_ms and until_ms");
  CHECK(problem_of("response-late delay_ms=soon") ==
        "response-late: delay_ms \"soon\": must be an integer, 0..86400000");
  CHECK(problem_of("response-late delay_ms=-5") == "response-late: delay_ms -5: must be 0..86400000");
  CHECK(problem_of("response-late delay_ms=1.5") ==
        "response-late: delay_ms 1.5: must be an integer, 0..86400000");
  CHECK(problem_of("response-late index=0x") ==
        "response-late: index \"0x\": must be an integer, 0x0000..0xFFFF");
  CHECK(problem_of("silent probability=nan") == "silent: probability \"nan\": must be 0..1");
  CHECK(problem_of("silent probability=2") == "silent: probability 2: must be 0..1");
  CHECK(
      problem_of("abort step=late") ==
      "abort: step \"late\": must be any, initiate, segment, block-segment, block-acknowledge, block-end or "
      "abort");
  CHECK(problem_of("abort step=1") ==
        "abort: step \"1\": must be any, initiate, segment, block-segment, block-acknowledge, block-end or "
        "abort");
  CHECK(problem_of("silent after") == "silent: \"after\": write key=value");
  CHECK(problem_of("silent after=") == "silent: \"after=\": write key=value");
  CHECK(problem_of("silent after=1 after=2") == "silent: after: given twice");
  CHECK(problem_of("silent from_ms=5 until_ms=5") == "silent: until_ms: must be more than from_ms");
  CHECK(problem_of("abort sub=1") == "abort: sub: index is missing");
  CHECK(problem_of("frame-loss first_id=2 last_id=1", FaultPlace::kBus) ==
        "frame-loss: last_id: must not be less than first_id");
}

TEST_CASE("The run-time lines of docs/reference/faults.md are good faults") {
  unsigned lines = 0;
  for (const std::string& line : lines_of(document())) {
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
