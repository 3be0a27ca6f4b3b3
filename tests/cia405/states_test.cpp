// SPDX-License-Identifier: MIT
// What blocks tell of devices: EMCY messages and NMT states.

#include "cia405/plant.hpp"
#include "support/catch.hpp"

namespace cbcan::cia405::test {

namespace {

/// An EMCY message of a node: its code, and error register 01h.
void emcy(Rig& rig, int node, const std::string& code) {
  rig.plant.command("fault " + std::to_string(node) + " emcy-storm count=1 code=" + code);
}

const EmcyError kGeneric{0x1000, 0x01, {}};

std::unique_ptr<RecvEmcyDev> emcy_of(Rig& rig, std::uint8_t device) {
  return rig.run<RecvEmcyDev>([device](RecvEmcyDev& block) { block.device = device; });
}

DeviceState state_of(Rig& rig, std::uint8_t device) {
  const auto block = rig.run<GetState>([device](GetState& state) { state.device = device; });
  CHECK(block->confirm);
  return block->state;
}

void command(Rig& rig, std::uint8_t device, TransitionState state) {
  const auto nmt = rig.run<Nmt>([&](Nmt& block) {
    block.device = device;
    block.state = state;
  });
  REQUIRE(nmt->confirm);
}

/// The module watches node 5, which has to report each second.
void watch(Rig& rig) {
  const auto write = rig.run<SdoWrite4>([](SdoWrite4& block) {
    block.index = 0x1016;
    block.subindex = 1;
    block.data = {0xE8, 0x03, 0x05, 0x00};
    block.datalength = 4;
  });
  REQUIRE(write->confirm);
}

const std::vector<std::string> kHeartbeat{"--heartbeat", "5=100"};

}  // namespace

TEST_CASE("RecvEmcyDev: no message yet, an error, no error any more") {
  Rig rig;
  auto block = emcy_of(rig, 5);
  CHECK(block->confirm);
  CHECK(block->errorinfo == EmcyError{});

  emcy(rig, 5, "0x1000");
  block = emcy_of(rig, 5);
  CHECK_FALSE(block->confirm);
  CHECK(block->error == KernelError::kOther);
  CHECK(block->errorinfo == kGeneric);
  block->enable = false;
  block->call(0);
  CHECK(block->error == KernelError::kNone);
  CHECK(block->errorinfo == EmcyError{});

  emcy(rig, 5, "0");
  block = emcy_of(rig, 5);
  CHECK(block->confirm);
  CHECK(block->error == KernelError::kNone);
  CHECK(block->errorinfo == EmcyError{});  // also the error register, which is 01h in this message
}

TEST_CASE("RecvEmcyDev of DEVICE 0 is the module's own message") {
  Rig rig;
  auto block = emcy_of(rig, 0);
  CHECK(block->confirm);
  rig.plant.command("fault bus bus-off until_ms=10");
  rig.plant.pass(20 * kMs);
  // Recovered from bus-off: 8140h, and 0000h as it is over.
  CHECK(rig.plant.frames("0FF#") == std::vector<std::string>{"0FF#4081110000000000", "0FF#0000000000000000"});
  block = emcy_of(rig, 0);
  CHECK(block->confirm);
  CHECK(block->errorinfo == EmcyError{});
}

TEST_CASE("RecvEmcy scans: errors in each round, what is over once, then nothing") {
  Rig rig({"--node", "6=" CBCAN_PLANTS "/demo/generic.eds"});
  const auto scan = [&] { return rig.run<RecvEmcy>([](RecvEmcy&) {}); };
  auto block = scan();
  CHECK(block->confirm);
  CHECK(block->device == 0);
  CHECK(block->errorinfo == EmcyError{});

  emcy(rig, 5, "0x1000");
  emcy(rig, 6, "0x2310");
  block = scan();
  CHECK(block->error == KernelError::kOther);
  CHECK_FALSE(block->confirm);
  CHECK(block->device == 5);
  CHECK(block->errorinfo == kGeneric);
  block = scan();
  CHECK(block->error == KernelError::kOther);
  CHECK(block->device == 6);
  CHECK(block->errorinfo.error_code == 0x2310);
  CHECK(scan()->device == 5);

  emcy(rig, 6, "0");
  block = scan();
  CHECK(block->confirm);
  CHECK(block->device == 6);
  CHECK(block->errorinfo == EmcyError{});
  emcy(rig, 5, "0");
  CHECK(scan()->device == 5);
  block = scan();
  CHECK(block->confirm);
  CHECK(block->device == 0);
  block->enable = false;
  block->call(0);
  CHECK_FALSE(block->confirm);
}

TEST_CASE("GetState: every state of a device that is watched, and that of one that is not") {
  Rig rig(kHeartbeat);
  CHECK(state_of(rig, 5) == DeviceState::kUnknown);
  watch(rig);
  rig.plant.pass(200 * kMs);
  CHECK(state_of(rig, 5) == DeviceState::kPreOperational);
  command(rig, 5, TransitionState::kStartRemoteNode);
  rig.plant.pass(200 * kMs);
  CHECK(state_of(rig, 5) == DeviceState::kOperational);
  command(rig, 5, TransitionState::kStopRemoteNode);
  rig.plant.pass(200 * kMs);
  CHECK(state_of(rig, 5) == DeviceState::kStopped);
  CHECK(state_of(rig, 6) == DeviceState::kUnknown);

  command(rig, 5, TransitionState::kResetCommunication);
  CHECK(state_of(rig, 5) == DeviceState::kInit);  // its boot-up message
  rig.plant.command("fault 5 silent");
  command(rig, 5, TransitionState::kResetCommunication);
  CHECK(state_of(rig, 5) == DeviceState::kResetComm);
  command(rig, 5, TransitionState::kResetNode);
  CHECK(state_of(rig, 5) == DeviceState::kResetApp);
  rig.plant.pass(2 * kSecond);
  CHECK(state_of(rig, 5) == DeviceState::kNotAvail);
}

TEST_CASE("GetState of DEVICE 0 is the module's own state") {
  Rig rig({"--node-id", "42"});
  CHECK(state_of(rig, 0) == DeviceState::kPreOperational);
  command(rig, 42, TransitionState::kStartRemoteNode);
  CHECK(state_of(rig, 0) == DeviceState::kOperational);
  CHECK(state_of(rig, 42) == DeviceState::kOperational);
}

}  // namespace cbcan::cia405::test
