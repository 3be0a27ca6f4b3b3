// SPDX-License-Identifier: MIT
#include "io/can/can_frames.hpp"

#include "io/can/msgpack_frames.hpp"
#include "support/catch.hpp"
#include "text/numbers.hpp"

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
  CHECK_FALSE(read_error_frame(error_frame(0x100)).overflow);
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

// What follows is written down from the formats of MessagePack's specification.

std::string bytes(std::initializer_list<int> values) {
  std::string text;
  for (const int value : values)
    text += static_cast<char>(value);
  return text;
}

const std::string kId = bytes({0xAE}) + "arbitration_id";

TEST_CASE(
    "datagrams: a frame has an identifier, what else it lacks is 0, and the map may be of the long kind") {
  CHECK(unpack(bytes({0x80})) == std::nullopt);
  CHECK(unpack(bytes({0x81}) + kId + bytes({0x05})) == Frame{5, 0, 0, {}});
  CHECK(unpack(bytes({0xDE, 0, 1}) + kId + bytes({0x05})) == Frame{5, 0, 0, {}});
  CHECK(unpack(bytes({0xDE, 0})) == std::nullopt);
  CHECK(unpack(bytes({0x05}) + kId + bytes({0x05})) == std::nullopt);  // no map
  CHECK(unpack(bytes({0x82}) + kId + bytes({0x05})) == std::nullopt);  // one entry is missing
  CHECK(unpack(bytes({0x81}) + kId) == std::nullopt);
}

TEST_CASE("datagrams: numbers of each size") {
  struct Row {
    std::string value;
    std::uint32_t id;
  };
  for (const Row& row :
       {Row{bytes({0x00}), 0}, Row{bytes({0x7F}), 0x7F}, Row{bytes({0xC0}), 0}, Row{bytes({0xC2}), 0},
        Row{bytes({0xC3}), 1}, Row{bytes({0xCC, 0xFE}), 0xFE}, Row{bytes({0xCD, 0x07, 0xFE}), 0x7FE},
        Row{bytes({0xCE, 0, 0, 0x07, 0xFD}), 0x7FD}, Row{bytes({0xCF, 0, 0, 0, 0, 0, 0, 0x07, 0xFC}), 0x7FC},
        Row{bytes({0xD0, 0x12}), 0x12}, Row{bytes({0xD1, 0x01, 0x12}), 0x112},
        Row{bytes({0xD2, 0, 0, 0x02, 0x12}), 0x212},
        Row{bytes({0xD3, 0, 0, 0, 0, 0, 0, 0x03, 0x12}), 0x312}}) {
    INFO(row.id);
    CHECK(unpack(bytes({0x81}) + kId + row.value) == Frame{row.id, 0, 0, {}});
  }
  for (const std::string& wrong :
       {bytes({0xCE, 0, 0, 8, 0}), bytes({0xCD, 8, 0}), bytes({0xC1}), bytes({0xC7, 0, 0}),
        bytes({0xD4, 1, 1}), bytes({0xC9}), bytes({0xDC, 0, 0}), bytes({0x90}), bytes({0xDE, 0, 0})})
    CHECK(unpack(bytes({0x81}) + kId + wrong) == std::nullopt);
}

TEST_CASE("datagrams: keys that mean nothing may have any value") {
  const std::string text300(300, 'x');
  for (const std::string& value :
       {bytes({0x05}), bytes({0xE0}), bytes({0xFF}), bytes({0xA0}), bytes({0xBF}) + std::string(31, 'x'),
        bytes({0xC0}), bytes({0xCA, 1, 2, 3, 4}), bytes({0xCB, 1, 2, 3, 4, 5, 6, 7, 8}),
        bytes({0xC4, 2, 1, 2}), bytes({0xC5, 1, 0x2C}) + text300, bytes({0xC6, 0, 0, 1, 0x2C}) + text300,
        bytes({0xD9, 2}) + "xx", bytes({0xDA, 1, 0x2C}) + text300, bytes({0xDB, 0, 0, 1, 0x2C}) + text300,
        bytes({0xD3, 1, 2, 3, 4, 5, 6, 7, 8})}) {
    INFO(text::hex(std::span(reinterpret_cast<const std::uint8_t*>(value.data()), value.size()), " "));
    CHECK(unpack(bytes({0x82, 0xA1, 'x'}) + value + kId + bytes({0x05})) == Frame{5, 0, 0, {}});
    CHECK(unpack(bytes({0x82, 0xA1, 'x'}) + value.substr(0, value.size() - 1)) == std::nullopt);
  }
}

TEST_CASE("datagrams: RTR, extended, FD, error; a length that fits and one that does not") {
  const auto entry = [](const std::string& key, int value) {
    return bytes({0xA0 | static_cast<int>(key.size())}) + key + bytes({value});
  };
  const std::string remote = entry("is_remote_frame", 0xC3), dlc = entry("dlc", 3);
  const std::string id = kId + bytes({0x05});
  CHECK(unpack(bytes({0x83}) + id + remote + dlc) == Frame{5, 3, Frame::kRemote, {}});
  CHECK(unpack(bytes({0x82}) + id + dlc) == std::nullopt);  // three bytes are missing
  const std::string data = entry("data", 0xC4) + bytes({3, 7, 8, 9});
  CHECK(unpack(bytes({0x83}) + id + dlc + data) == Frame{5, 3, 0, {7, 8, 9}});
  CHECK(unpack(bytes({0x84}) + id + remote + dlc + data) == std::nullopt);
  CHECK(unpack(bytes({0x83}) + id + entry("dlc", 8) + entry("data", 0xC4) +
               bytes({8, 1, 2, 3, 4, 5, 6, 7, 8})) == Frame{5, 8, 0, {1, 2, 3, 4, 5, 6, 7, 8}});
  const std::string extended = entry("is_extended_id", 0xC3);
  CHECK(unpack(bytes({0x82}) + extended + kId + bytes({0xCE, 0x1F, 0xFF, 0xFF, 0xFF})) ==
        Frame{0x1FFFFFFF, 0, Frame::kExtended, {}});
  CHECK(unpack(bytes({0x82}) + extended + kId + bytes({0xCE, 0x20, 0, 0, 0})) == std::nullopt);
  CHECK(unpack(bytes({0x82}) + id + entry("is_fd", 0xC3)) == std::nullopt);
  CHECK(unpack(bytes({0x82}) + id + entry("is_error_frame", 0xC3)) == std::nullopt);
}

TEST_CASE("datagrams: what is sent, byte by byte") {
  const auto text = [](const Frame& frame, Time time) {
    const auto packed = pack_frame(frame, time);
    return std::string(packed.begin(), packed.end());
  };
  const auto datagram_of = [](const std::string& time, const std::string& id, int extended, int remote,
                              int dlc, const std::string& data) {
    return bytes({0x8B, 0xA9}) + "timestamp" + bytes({0xCB}) + time + kId + bytes({0xCE}) + id +
           bytes({0xAE}) + "is_extended_id" + bytes({extended, 0xAF}) + "is_remote_frame" +
           bytes({remote, 0xAE}) + "is_error_frame" + bytes({0xC2, 0xA7}) + "channel" + bytes({0xC0, 0xA3}) +
           "dlc" + bytes({0xCE, 0, 0, 0, dlc, 0xA4}) + "data" + bytes({0xC4}) + data + bytes({0xA5}) +
           "is_fd" + bytes({0xC2, 0xAE}) + "bitrate_switch" + bytes({0xC2, 0xB5}) + "error_state_indicator" +
           bytes({0xC2});
  };
  // 1.5 as IEEE 754: 3FF8 0000 0000 0000.
  CHECK(text({0x123, 2, 0, {0x42, 0x43}}, 1'500'000) == datagram_of(bytes({0x3F, 0xF8, 0, 0, 0, 0, 0, 0}),
                                                                    bytes({0, 0, 1, 0x23}), 0xC2, 0xC2, 2,
                                                                    bytes({2, 0x42, 0x43})));
  CHECK(text({0x701, 1, Frame::kRemote, {}}, 0) ==
        datagram_of(std::string(8, '\0'), bytes({0, 0, 7, 1}), 0xC2, 0xC3, 1, bytes({0})));
  CHECK(text({0x1ABCDEF0, 0, Frame::kExtended, {}}, 0) ==
        datagram_of(std::string(8, '\0'), bytes({0x1A, 0xBC, 0xDE, 0xF0}), 0xC3, 0xC2, 0, bytes({0})));
}

}  // namespace
}  // namespace cbcan::io
