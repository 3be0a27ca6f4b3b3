// SPDX-License-Identifier: MIT
// Faults of SDO responses of a simulated node: faulty_responses.txt, with every frame written out.
#include "sim/faulty_plant.hpp"
#include "support/case_file.hpp"

using namespace cbcan::test;

TEST_CASE("Each fault of the table makes its responses, in every transfer mode and at every step") {
  Texts requests;
  for (const FileCase& each : cases_of("tests/sim/faulty_responses.txt")) {
    if (each.given.size() > 1) requests.clear();
    for (const std::string& line : each.given)
      if (line.starts_with("> ")) requests.push_back(line.substr(2));
    FaultyPlant plant;
    plant.set(each.given.back());
    plant.send(requests);
    plant.pass(10 * cbcan::kSecond);
    each.check(plant.heard());
  }
}

TEST_CASE("One byte less than the least that can be said is one more") {
  using cbcan::sim::SdoStep;
  const cbcan::sim::Fault fault =
      cbcan::test::fault_from("response-other-size", cbcan::sim::FaultPlace::kNode);
  const auto other = [&](SdoStep step, const char* frame) {
    return cbcan::test::text_of(changed(fault, {step, 0}, cbcan::test::frame_from(frame)));
  };
  CHECK(other(SdoStep::kInitiate, "585#4F01200005000000") == "585#4B01200005000000");
  CHECK(other(SdoStep::kInitiate, "585#4101200000000000") == "585#4101200001000000");
  CHECK(other(SdoStep::kSegment, "585#0F00000000000000") == "585#0D00000000000000");
  CHECK(other(SdoStep::kBlockEnd, "585#DD00000000000000") == "585#D900000000000000");
}

TEST_CASE("An acknowledgement of no segment tells of one") {
  const cbcan::sim::Fault fault =
      cbcan::test::fault_from("response-other-sequence", cbcan::sim::FaultPlace::kNode);
  const cbcan::sim::SdoResponse response{cbcan::sim::SdoStep::kBlockAcknowledge, 0};
  CHECK(cbcan::test::text_of(changed(fault, response, cbcan::test::frame_from("585#A2007F0000000000"))) ==
        "585#A2017F0000000000");
}
