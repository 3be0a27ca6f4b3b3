// SPDX-License-Identifier: MIT
// The master of examples/, polled when it says so and at no other time.
#include "../../examples/master/master.hpp"

#include "support/bench.hpp"

namespace cbcan::test {

namespace {

struct MasterOnWire : Wire {
  void poll() {
    while (master.poll(0) <= 0) {
    }
  }
  Master master{port};
};

}  // namespace

TEST_CASE("The master begins its boot again after a reset of its own node") {
  MasterOnWire rig;
  rig.master.start(0);
  rig.poll();
  rig.expect("77F#00", "000#8200");
  for (const char* const reset : {"000#827F", "000#817F"}) {
    rig.master.on_frame(frame_from(reset), 0);
    rig.poll();
    rig.expect("77F#00", "000#8200");
  }
}

}  // namespace cbcan::test
