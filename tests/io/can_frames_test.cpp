// SPDX-License-Identifier: MIT
#include "io/can/can_frames.hpp"

#include "io/can/msgpack_frames.hpp"
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

TEST_CASE("what the kernel leaves in unused data bytes is not looked at") {
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
}

TEST_CASE("a data frame with an error's identifier says nothing about the controller") {
  const ControllerReport report = read_error_frame({0x044, 8, 0, {0, 0x11}});
  CHECK_FALSE(report.state.has_value());
  CHECK_FALSE(report.overflow);
}

/// As MessagePack's specification writes them: fixmap, fixstr, float 64, uint 16, bin 8 and so on.
std::string datagram(const std::string& id, const std::string& dlc_and_data, const std::string& fd = "\xC2",
                     const std::string& error = "\xC2") {
  return "\x89\xA9timestamp\xCB\x3F\xF8" + std::string(6, '\0') +
         "\xAE"
         "arbitration_id" +
         id + "\xAEis_extended_id\xC2\xAFis_remote_frame\xC2\xAEis_error_frame" + error +
         "\xA7"
         "channel\xA4"
         "can0" +
         dlc_and_data + "\xA5is_fd" + fd;
}

std::optional<Frame> unpack(const std::string& text) {
  return unpack_frame({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST_CASE("a number that is no identifier or length is none, whatever its bits are") {
  const std::string one =
      "\xA3"
      "dlc\x01\xA4"
      "data\xC4\x01\x42";
  CHECK(unpack(datagram(std::string("\xD0\x05"), one)) == Frame{0x005, 1, 0, {0x42}});
  CHECK(unpack(datagram(std::string("\xD1\x07\xFF"), one)) == Frame{0x7FF, 1, 0, {0x42}});
  for (const std::string& id :
       {std::string("\xFF"), std::string("\xE0"), std::string("\xD0\xFF"), std::string("\xD0\x80"),
        std::string("\xD1\xFF\xFF"), std::string("\xD2\xFF\xFF\xFF\xFF"),
        std::string("\xD3") + std::string(8, '\xFF'), std::string("\xCA\0\0\0\x05", 5),
        std::string("\xCB\0\0\0\0\0\0\0\x05", 9)})
    CHECK(unpack(datagram(id, one)) == std::nullopt);
  CHECK(unpack(datagram("\x05",
                        "\xA3"
                        "dlc\xFF\xA4"
                        "data\xC4\x01\x42")) == std::nullopt);
  CHECK(unpack(std::string("\x82\xA3"
                           "dlc\x01\xA4"
                           "data\xC4\x01\x42")) == std::nullopt);  // without an identifier: 0 would be NMT
}

TEST_CASE("datagrams of python-can's udp_multicast") {
  const std::string two =
      "\xA3"
      "dlc\x02\xA4"
      "data\xC4\x02\x01\xFF";
  CHECK(unpack(datagram("\xCD\x01\x23", two)) == Frame{0x123, 2, 0, {1, 0xFF}});
  CHECK(unpack(datagram(std::string("\xCE\0\0\x07\xFF", 5), two)) == Frame{0x7FF, 2, 0, {1, 0xFF}});
  for (const std::string& wrong : {datagram("\xCD\x08\x01", two), datagram("\xCD\x01\x23", two, "\xC3"),
                                   datagram("\xCD\x01\x23", two, "\xC2", "\xC3"),
                                   datagram("\x05",
                                            "\xA3"
                                            "dlc\x09\xA4"
                                            "data\xC4\x01\x01"),
                                   datagram("\x05", two) + "\xC0", datagram("\x05", two).substr(0, 60),
                                   datagram("\x93\x01\x02\x03", two),
                                   std::string("\x81\xA4"
                                               "data\xC6\xFF\xFF\xFF\xFF"),
                                   std::string()})
    CHECK(unpack(wrong) == std::nullopt);
  const auto packed = pack_frame({0x123, 1, Frame::kExtended, {0x42}}, 1'500'000);
  CHECK(std::string(packed.begin(), packed.begin() + 20) ==
        std::string("\x8B\xA9timestamp\xCB\x3F\xF8\0\0\0\0\0\0", 20));
  CHECK(unpack_frame(packed) == Frame{0x123, 1, Frame::kExtended, {0x42}});
}

}  // namespace
}  // namespace cbcan::io
