// SPDX-License-Identifier: MIT
#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

constexpr const char* kConfiguration = "7E5#0401000000000000";

}  // namespace

TEST_CASE("[LSS-1] who it is") {
  Window window;
  for (const char* part : {"40", "41", "42"})
    window.arrive("7E5#" + std::string(part) + "00000000000000").expect_silence();
  window.arrive("7E5#4300000000000000").expect("7E4#4400000000000000");
  for (const char* part : {"5A", "5B", "5C", "5D"})
    window.arrive("7E5#" + std::string(part) + "00000000000000")
        .expect("7E4#" + std::string(part) + "00000000000000");
  window.arrive("7E5#5E00000000000000").expect("7E4#5E7F000000000000");
  window.arrive("7E5#0400000000000000").expect_silence();
  window.arrive("7E5#5E00000000000000").expect_silence();
  for (const char* part : {"46", "47", "48", "49", "4A"})
    window.arrive("7E5#" + std::string(part) + "00000000000000").expect_silence();
  window.arrive("7E5#4B00000000000000").expect("7E4#4F00000000000000");
  window.arrive("7E5#4C00000000000000").expect_silence();  // it has a node ID
}

TEST_CASE("[LSS-1] in every own state, while a transaction is in progress") {
  Window window;
  window.write(0, 0x1F82, 127, 1, {4}).check_done();  // stopped
  window.read(5, 0x2000, 1, 4).expect("605#4000200100000000");
  window.arrive(kConfiguration).expect_silence();
  window.arrive("7E5#5E00000000000000").expect("7E4#5E7F000000000000");
  window.arrive("585#4300200111223344").check_done();
}

TEST_CASE("[LSS-2] until the next start the own node keeps what it has") {
  Window window;
  window.arrive(kConfiguration);
  window.arrive("7E5#1105000000000000").expect("7E4#1100000000000000");
  window.arrive("7E5#1500000000000000").expect_silence();  // activate bit timing
  window.arrive("7E5#5E00000000000000").expect("7E4#5E7F000000000000");
  window.write(0, 0x1F82, 127, 1, {130}).expect("77F#00");
  window.arrive("7E5#5E00000000000000").expect_silence();  // in the waiting state again
  window.arrive(kConfiguration);
  window.arrive("7E5#5E00000000000000").expect("7E4#5E7F000000000000");
}

TEST_CASE("[LSS-3] where nothing can be stored") {
  Window window;
  window.arrive(kConfiguration);
  window.arrive("7E5#1300020000000000").expect("7E4#1301000000000000");
  window.arrive("7E5#1700000000000000").expect("7E4#1701000000000000");
}
