// SPDX-License-Identifier: MIT
// Each block's outputs and errors.

#include "cia405/plant.hpp"
#include "support/catch.hpp"

namespace cbcan::cia405::test {

namespace {

using Bytes = std::vector<std::uint8_t>;

/// Node 5's 2004h, four bytes.
void four_bytes(SdoAccess& block) {
  block.device = 5;
  block.index = 0x2004;
}

}  // namespace

TEST_CASE("GetLocalNodeId tells the module's node ID") {
  Rig rig({"--node-id", "42"});
  const auto block = rig.run<GetLocalNodeId>([](auto&) {});
  CHECK(block->confirm);
  CHECK(block->error == KernelError::kNone);
  CHECK(block->device == 42);
}

TEST_CASE("GetCanopenKernelState tells state and node ID") {
  Rig rig;
  auto block = rig.run<GetCanopenKernelState>([](auto&) {});
  CHECK(block->confirm);
  CHECK(block->state == KernelError::kNone);
  CHECK(block->device == 127);

  rig.plant.command("fault bus overflow");
  block = rig.run<GetCanopenKernelState>([](auto&) {});
  CHECK(block->confirm);
  CHECK(block->state == KernelError::kOverflow);

  rig.plant.command("fault bus error-passive");
  block = rig.run<GetCanopenKernelState>([](auto&) {});
  CHECK(block->confirm);
  CHECK(block->state == KernelError::kErrorPassive);

  rig.plant.command("fault bus bus-off");
  block = rig.run<GetCanopenKernelState>([](auto&) {});
  CHECK(block->confirm);
  CHECK(block->error == KernelError::kNone);
  CHECK(block->state == KernelError::kBusOff);
  CHECK(block->device == 127);
}

TEST_CASE("SdoWrite4 and SdoRead4 carry one to four bytes, low byte first") {
  Rig rig;
  const auto size = GENERATE(std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{3}, std::uint8_t{4});
  const std::array<std::uint8_t, 4> all{0x67, 0x45, 0x23, 0x01};
  const auto index = static_cast<std::uint16_t>(0x2000 + size);
  const auto write = rig.run<SdoWrite4>([&](SdoWrite4& block) {
    block.device = 5;
    block.index = index;
    block.data = all;
    block.datalength = size;
  });
  CHECK(write->confirm);
  const auto read = rig.run<SdoRead4>([&](SdoRead4& block) {
    block.device = 5;
    block.index = index;
  });
  CHECK(read->confirm);
  CHECK(read->datalength == size);
  std::array<std::uint8_t, 4> expected{};
  std::copy_n(all.begin(), size, expected.begin());
  CHECK(read->data == expected);
  // 2Fh, 2Bh, 27h, 23h: expedited with the size
  const std::vector<std::string> requests{"605#2F01200067000000", "605#2B02200067450000",
                                          "605#2703200067452300", "605#2304200067452301"};
  CHECK(rig.plant.frames("605#2").front() == requests[size - 1u]);
}

TEST_CASE("SdoWrite and SdoRead carry 128 bytes, in each mode that can") {
  Rig rig;
  const auto mode = GENERATE(SdoMode::kAuto, SdoMode::kSegmented, SdoMode::kBlock);
  Bytes bytes(128);
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(i + 1);
  const auto write = rig.run<SdoWrite>([&](SdoWrite& block) {
    block.device = 5;
    block.index = 0x2080;
    block.mode = mode;
    block.data = bytes;
  });
  REQUIRE(write->confirm);
  const std::string request = mode == SdoMode::kBlock ? "605#C680200080000000" : "605#2180200080000000";
  CHECK(rig.plant.frames("605#").front() == request);

  Bytes buffer(128);
  const auto read = rig.run<SdoRead>([&](SdoRead& block) {
    block.device = 5;
    block.index = 0x2080;
    block.data = buffer;
  });
  REQUIRE(read->confirm);
  CHECK(read->datalength == 128);
  CHECK(buffer == bytes);
}

TEST_CASE("SdoRead leaves what the object does not fill") {
  Rig rig;
  Bytes buffer(10, 0xEE);
  const auto read = rig.run<SdoRead>([&](SdoRead& block) {
    four_bytes(block);
    block.data = buffer;
  });
  REQUIRE(read->confirm);
  CHECK(read->datalength == 4);
  CHECK(buffer == Bytes{0, 0, 0, 0, 0xEE, 0xEE, 0xEE, 0xEE, 0xEE, 0xEE});
}

TEST_CASE("SdoWrite in expedited mode cannot carry five bytes") {
  Rig rig;
  const Bytes bytes(5);
  const auto write = rig.run<SdoWrite>([&](SdoWrite& block) {
    block.device = 5;
    block.index = 0x2005;
    block.mode = SdoMode::kExpedited;
    block.data = bytes;
  });
  CHECK(write->error == KernelError::kOther);
  CHECK(write->errorinfo == 0x06010000);
  CHECK_FALSE(write->confirm);
}

TEST_CASE("DEVICE 0 is the module's own object dictionary") {
  Rig rig;
  const auto read = rig.run<SdoRead4>([](SdoRead4& block) { block.index = 0x3001; });
  CHECK(read->confirm);
  CHECK(read->datalength == 1);
  CHECK(read->data[0] == 127);
  CHECK(rig.plant.frames("67F#").empty());
}

TEST_CASE("an abort of the device is ERROR 01h with its code in ERRORINFO, for each SDO block") {
  Rig rig;
  Bytes buffer(4);
  const auto read4 = rig.run<SdoRead4>([](SdoRead4& block) {
    block.device = 5;
    block.index = 0x2FFF;
  });
  CHECK(read4->error == KernelError::kOther);
  CHECK(read4->errorinfo == 0x06020000);
  CHECK_FALSE(read4->confirm);
  CHECK(read4->datalength == 0);
  const auto read = rig.run<SdoRead>([&](SdoRead& block) {
    block.device = 5;
    block.index = 0x2201;  // write only
    block.data = buffer;
  });
  CHECK(read->error == KernelError::kOther);
  CHECK(read->errorinfo == 0x06010001);
  const auto write4 = rig.run<SdoWrite4>([](SdoWrite4& block) {
    block.device = 5;
    block.index = 0x2200;  // read only
    block.datalength = 1;
  });
  CHECK(write4->error == KernelError::kOther);
  CHECK(write4->errorinfo == 0x06010002);
  const auto write = rig.run<SdoWrite>([&](SdoWrite& block) {
    block.device = 5;
    block.index = 0x2200;
    block.data = buffer;
  });
  CHECK(write->error == KernelError::kOther);
  CHECK(write->errorinfo == 0x06010002);
}

TEST_CASE("Nmt sends each command, to one device or to all") {
  Rig rig;
  const std::vector<std::pair<TransitionState, std::string>> commands{
      {TransitionState::kStopRemoteNode, "000#0205"},
      {TransitionState::kStartRemoteNode, "000#0105"},
      {TransitionState::kResetNode, "000#8105"},
      {TransitionState::kResetCommunication, "000#8205"},
      {TransitionState::kEnterPreOperational, "000#8005"}};
  for (const auto& [state, frame] : commands) {
    const auto nmt = rig.run<Nmt>([state = state](Nmt& block) {
      block.device = 5;
      block.state = state;
    });
    CHECK(nmt->confirm);
    CHECK(rig.plant.frames("000#").back() == frame);
  }
  const auto all = rig.run<Nmt>([](Nmt& block) { block.state = TransitionState::kStartRemoteNode; });
  CHECK(all->confirm);
  CHECK(rig.plant.frames("000#").back() == "000#0100");
}

TEST_CASE("Nmt with a state that there is not is ERROR 21h, and nothing is sent") {
  Rig rig;
  const auto state = GENERATE(TransitionState{}, TransitionState{3}, TransitionState{128},
                              TransitionState::kAllExceptNmtAndSender);
  const auto nmt = rig.run<Nmt>([state](Nmt& block) {
    block.device = 5;
    block.state = state;
  });
  CHECK(nmt->error == KernelError::kInternal);
  CHECK_FALSE(nmt->confirm);
  CHECK(rig.plant.frames("000#").empty());
}

TEST_CASE("DEVICE above 127 is ERROR 21h at the rising edge, for each block that has it") {
  Rig rig;
  Bytes buffer(4);
  const auto edge = [](auto& block) {
    block.device = 128;
    block.enable = true;
    block.call(0);
    return block.error;
  };
  Nmt nmt(rig.program.link);
  nmt.state = TransitionState::kStartRemoteNode;
  CHECK(edge(nmt) == KernelError::kInternal);
  RecvEmcyDev emcy(rig.program.link);
  CHECK(edge(emcy) == KernelError::kInternal);
  GetState state(rig.program.link);
  CHECK(edge(state) == KernelError::kInternal);
  SdoRead read(rig.program.link);
  read.data = buffer;
  CHECK(edge(read) == KernelError::kInternal);
  SdoRead4 read4(rig.program.link);
  CHECK(edge(read4) == KernelError::kInternal);
  SdoWrite write(rig.program.link);
  write.data = buffer;
  CHECK(edge(write) == KernelError::kInternal);
  SdoWrite4 write4(rig.program.link);
  write4.datalength = 1;
  CHECK(edge(write4) == KernelError::kInternal);
}

TEST_CASE("CHANNEL, MODE and TIMEOUT out of range, and NETWORK 0 and 248, are ERROR 21h") {
  Rig rig;
  const Bytes byte(1);
  const auto error = [&](const std::function<void(SdoWrite&)>& spoil) {
    return rig
        .run<SdoWrite>([&](SdoWrite& block) {
          block.device = 5;
          block.index = 0x2001;
          block.data = byte;
          spoil(block);
        })
        ->error;
  };
  CHECK(error([](SdoWrite&) {}) == KernelError::kNone);
  CHECK(error([](SdoWrite& block) { block.channel = 0; }) == KernelError::kInternal);
  CHECK(error([](SdoWrite& block) { block.channel = 2; }) == KernelError::kInternal);
  CHECK(error([](SdoWrite& block) { block.mode = SdoMode{4}; }) == KernelError::kInternal);
  CHECK(error([](SdoWrite& block) { block.timeout = 65535; }) == KernelError::kNone);
  CHECK(error([](SdoWrite& block) { block.timeout = 65536; }) == KernelError::kInternal);
  CHECK(error([](SdoWrite& block) { block.network = 0; }) == KernelError::kInternal);
  CHECK(error([](SdoWrite& block) { block.network = 248; }) == KernelError::kInternal);
}

TEST_CASE("DATALENGTH 0 and above 128, or above four, is ERROR 21h") {
  Rig rig;
  Bytes buffer(129);
  const auto read = [&](std::size_t size) {
    return rig
        .run<SdoRead>([&](SdoRead& block) {
          four_bytes(block);
          block.data = std::span(buffer).first(size);
        })
        ->error;
  };
  CHECK(read(128) == KernelError::kNone);
  CHECK(read(0) == KernelError::kInternal);
  CHECK(read(129) == KernelError::kInternal);
  const auto write = [&](std::size_t size) {
    return rig
        .run<SdoWrite>([&](SdoWrite& block) {
          block.device = 5;
          block.index = 0x2080;
          block.data = std::span(buffer).first(size);
        })
        ->error;
  };
  CHECK(write(128) == KernelError::kNone);
  CHECK(write(0) == KernelError::kInternal);
  CHECK(write(129) == KernelError::kInternal);
  const auto write4 = [&](std::uint8_t size) {
    return rig
        .run<SdoWrite4>([&](SdoWrite4& block) {
          four_bytes(block);
          block.datalength = size;
        })
        ->error;
  };
  CHECK(write4(4) == KernelError::kNone);
  CHECK(write4(0) == KernelError::kInternal);
  CHECK(write4(5) == KernelError::kInternal);
}

TEST_CASE("SdoRead into a buffer that has become smaller is ERROR 21h, and writes nothing") {
  Rig rig;
  Bytes buffer(4, 0xEE);
  SdoRead read(rig.program.link);
  four_bytes(read);
  read.data = buffer;
  read.enable = true;
  read.call(0);
  read.data = std::span(buffer).first(3);
  rig.program.blocks = {&read};
  rig.until([&] { return read.confirm || read.error != KernelError::kNone; });
  CHECK(read.error == KernelError::kInternal);
  CHECK(buffer == Bytes(4, 0xEE));
}

TEST_CASE("the module's time-out and mode are written when they change, and after what resets them") {
  Rig rig;
  const auto read_local = [&](std::uint16_t index) {
    const auto read = rig.run<SdoRead4>([index](SdoRead4& block) { block.index = index; });
    return read->data[0] | read->data[1] << 8;
  };
  const auto read_with = [&](std::uint32_t timeout) {
    return rig
        .run<SdoRead4>([timeout](SdoRead4& block) {
          four_bytes(block);
          block.timeout = timeout;
        })
        ->confirm;
  };
  CHECK(read_local(0x3003) == 1000);
  CHECK(read_with(300));
  CHECK(read_local(0x3003) == 300);
  CHECK(read_with(0));
  CHECK(read_local(0x3003) == 0);
  CHECK(read_with(300));

  const Bytes byte(1);
  const auto write = rig.run<SdoWrite>([&](SdoWrite& block) {
    block.device = 5;
    block.index = 0x2001;
    block.data = byte;
    block.mode = SdoMode::kSegmented;
  });
  CHECK(write->confirm);
  CHECK(read_local(0x3004) == 2);
  CHECK(read_with(300));
  CHECK(read_local(0x3004) == 0);

  const auto reset = rig.run<Nmt>([](Nmt& block) {
    block.device = 127;
    block.state = TransitionState::kResetNode;
    block.timeout = 300;
  });
  CHECK(reset->confirm);
  CHECK(read_local(0x3003) == 1000);
  CHECK(read_with(300));
  CHECK(read_local(0x3003) == 300);

  const auto meddle = rig.run<SdoWrite4>([&](SdoWrite4& block) {
    block.index = 0x3003;
    block.datalength = 2;
    block.data = {7, 0};
  });
  CHECK(meddle->confirm);
  CHECK(read_with(300));
  CHECK(read_local(0x3003) == 300);
}

}  // namespace cbcan::cia405::test
