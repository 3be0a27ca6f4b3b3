// SPDX-License-Identifier: MIT
#include "cbcan/modbus/identification.hpp"

#include <algorithm>

namespace cbcan::modbus {

namespace {

constexpr std::uint8_t kReadDeviceIdentification = 0x0E;  // MEI type
constexpr std::uint8_t kBasicStream = 1;
constexpr std::uint8_t kOneObject = 4;
constexpr std::uint8_t kBasicStreamAndOneObject = 0x81;  // conformity level
constexpr std::uint8_t kNoMoreFollows = 0;
constexpr std::uint8_t kNoNextObject = 0;
constexpr std::size_t kBasicObjects = std::tuple_size_v<DeviceIdentity>;
constexpr std::size_t kMaxObjectText = 64;

}  // namespace

Access Identification::check(Pdu pdu, const RegisterMap& /*registers*/) const {
  if (pdu[0] != kEncapsulatedInterface) return {Exception::kIllegalFunction};
  if (pdu.size() < 2) return {Exception::kIllegalValue};
  if (pdu[1] != kReadDeviceIdentification) return {Exception::kIllegalFunction};
  if (pdu.size() != 4 || pdu[2] < kBasicStream || pdu[2] > kOneObject) return {Exception::kIllegalValue};
  return {pdu[2] == kOneObject && pdu[3] >= kBasicObjects ? Exception::kIllegalAddress : Exception::kNone};
}

std::size_t Identification::execute(Pdu pdu, const RegisterMap& /*registers*/,
                                    std::span<std::uint8_t> response) const {
  // A stream from an object that does not exist starts at the first one.
  const std::size_t first = pdu[3] < kBasicObjects ? pdu[3] : 0;
  const std::size_t last = pdu[2] == kOneObject ? first : kBasicObjects - 1;
  const auto count = static_cast<std::uint8_t>(last - first + 1);
  const auto head =
      std::to_array({pdu[0], pdu[1], pdu[2], kBasicStreamAndOneObject, kNoMoreFollows, kNoNextObject, count});
  auto end = std::ranges::copy(head, response.begin()).out;
  for (std::size_t id = first; id <= last; ++id) {
    const std::string_view text = identity_[id].substr(0, kMaxObjectText);
    *end++ = static_cast<std::uint8_t>(id);
    *end++ = static_cast<std::uint8_t>(text.size());
    end = std::ranges::copy(text, end).out;
  }
  return static_cast<std::size_t>(end - response.begin());
}

}  // namespace cbcan::modbus
