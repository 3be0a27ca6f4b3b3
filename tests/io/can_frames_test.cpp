// SPDX-License-Identifier: MIT
#include "io/can/can_frames.hpp"

#include "support/catch.hpp"

namespace cbcan::io {
namespace {

Frame error_frame(std::uint32_t error_class, std::uint8_t details = 0) {
  Frame frame{error_class, 8, Frame::kError, {}};
  frame.data[1] = details;
  return frame;
}

can_frame dirty_frame(std::uint32_t can_id, std::uint8_t dlc) {
  can_frame frame{};
  frame.can_id = can_id;
  frame.can_dlc = dlc;
  for (std::uint8_t i = 0; i < 8; ++i)
    frame.data[i] = static_cast<std::uint8_t>(i + 1);
  return frame;
}

TEST_CASE("frames keep their identifier, kind, length and data on the way to the kernel and back") {
  // Flag bits of can_id: 8000 0000h extended, 4000 0000h RTR, 2000 0000h error (linux/can.h).
  const struct {
    Frame frame;
    std::uint32_t can_id;
  } cases[]{
      {{0x605, 8, 0, {0x40, 0x17, 0x10}}, 0x605},
      {{0x7FF, 0, 0, {}}, 0x7FF},
      {{0x742, 1, Frame::kRemote, {}}, 0x40000742},
      {{0x1ABCDEF0, 2, Frame::kExtended, {1, 2}}, 0x9ABCDEF0},
      {{0x005, 3, Frame::kExtended | Frame::kRemote, {}}, 0xC0000005},
      {{0x044, 8, Frame::kError, {0, 0x30}}, 0x20000044},
  };
  for (const auto& [frame, can_id] : cases) {
    const can_frame kernel = to_kernel(frame);
    CHECK(kernel.can_id == can_id);
    CHECK(kernel.can_dlc == frame.length);
    CHECK(kernel.data[1] == frame.data[1]);
    CHECK(from_kernel(kernel) == frame);
  }
}

TEST_CASE("unused data bytes from the kernel are ignored") {
  CHECK(from_kernel(dirty_frame(0x40000701, 1)) == Frame{0x701, 1, Frame::kRemote, {}});
  CHECK(from_kernel(dirty_frame(0x701, 1)) == Frame{0x701, 1, 0, {1}});
  CHECK(from_kernel(dirty_frame(0x701, 15)).length == 8);
}

TEST_CASE("error frames tell the controller's state") {
  CHECK(read_error_frame(error_frame(0x040)).state == BusState::kBusOff);
  CHECK(read_error_frame(error_frame(0x044, 0x10)).state == BusState::kBusOff);
  CHECK(read_error_frame(error_frame(0x100)).state == BusState::kActive);
  CHECK(read_error_frame(error_frame(0x004, 0x10)).state == BusState::kErrorPassive);
  CHECK(read_error_frame(error_frame(0x004, 0x20)).state == BusState::kErrorPassive);
  CHECK(read_error_frame(error_frame(0x004, 0x40)).state == BusState::kActive);
  CHECK(read_error_frame(error_frame(0x004, 0x04)).state == BusState::kActive);
  CHECK(read_error_frame(error_frame(0x004, 0x14)).state == BusState::kErrorPassive);
  CHECK_FALSE(read_error_frame(error_frame(0x004, 0x02)).state.has_value());
  CHECK_FALSE(read_error_frame(error_frame(0x020)).state.has_value());
}

TEST_CASE("an overflow of the controller is no state of fault confinement") {
  const ControllerReport report = read_error_frame(error_frame(0x004, 0x01));
  CHECK(report.overflow);
  CHECK_FALSE(report.state.has_value());
  CHECK_FALSE(read_error_frame(error_frame(0x004, 0x10)).overflow);
  CHECK_FALSE(read_error_frame(error_frame(0x100)).overflow);
}

TEST_CASE("a data frame with an error's identifier says nothing about the controller") {
  const ControllerReport report = read_error_frame({0x044, 8, 0, {0, 0x11}});
  CHECK_FALSE(report.state.has_value());
  CHECK_FALSE(report.overflow);
}

}  // namespace
}  // namespace cbcan::io
