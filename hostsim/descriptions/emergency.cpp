// SPDX-License-Identifier: MIT
#include "descriptions/emergency.hpp"

#include <algorithm>

namespace cbcan::descriptions {

namespace {

struct Meaning {
  std::uint16_t code;
  std::uint16_t mask;  ///< which bits of a code are compared
  std::string_view words;
};

constexpr std::uint16_t kExactly = 0xFFFF;
constexpr std::uint16_t kClass = 0xFF00;
constexpr std::uint16_t kGroup = 0xF000;

/// CiA 301, table 26; the first row that matches is used. A class that is not listed belongs to its group: 73xxh
/// of drives to 70xxh.
constexpr std::array kMeanings{
    Meaning{0x8110, kExactly, "CAN overrun, objects lost"},
    Meaning{0x8120, kExactly, "CAN in error passive mode"},
    Meaning{0x8130, kExactly, "life guard error or heartbeat error"},
    Meaning{0x8140, kExactly, "recovered from bus off"},
    Meaning{0x8150, kExactly, "CAN-ID collision"},
    Meaning{0x8210, kExactly, "PDO not processed due to length error"},
    Meaning{0x8220, kExactly, "PDO length exceeded"},
    Meaning{0x8230, kExactly, "DAM MPDO not processed, destination object not available"},
    Meaning{0x8240, kExactly, "unexpected SYNC data length"},
    Meaning{0x8250, kExactly, "RPDO timeout"},
    Meaning{0x2100, kClass, "current, input side"},
    Meaning{0x2200, kClass, "current inside the device"},
    Meaning{0x2300, kClass, "current, output side"},
    Meaning{0x3100, kClass, "mains voltage"},
    Meaning{0x3200, kClass, "voltage inside the device"},
    Meaning{0x3300, kClass, "output voltage"},
    Meaning{0x4100, kClass, "ambient temperature"},
    Meaning{0x4200, kClass, "device temperature"},
    Meaning{0x6100, kClass, "internal software"},
    Meaning{0x6200, kClass, "user software"},
    Meaning{0x6300, kClass, "data set"},
    Meaning{0x8100, kClass, "communication"},
    Meaning{0x8200, kClass, "protocol error"},
    Meaning{0xFF00, kClass, "device-specific"},
    Meaning{0x0000, kGroup, "no error, or an error has ended"},
    Meaning{0x1000, kGroup, "generic error"},
    Meaning{0x2000, kGroup, "current"},
    Meaning{0x3000, kGroup, "voltage"},
    Meaning{0x4000, kGroup, "temperature"},
    Meaning{0x5000, kGroup, "device hardware"},
    Meaning{0x6000, kGroup, "device software"},
    Meaning{0x7000, kGroup, "additional modules"},
    Meaning{0x8000, kGroup, "monitoring"},
    Meaning{0x9000, kGroup, "external error"},
    Meaning{0xF000, kGroup, "additional functions"},
};

}  // namespace

EmergencyMessage emergency_from(std::span<const std::uint8_t, EmergencyMessage::kSize> bytes) {
  EmergencyMessage message;
  message.code = static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8);
  message.error_register = bytes[2];
  std::copy(bytes.begin() + 3, bytes.end(), message.info.begin());
  return message;
}

std::string_view emergency_meaning(std::uint16_t code) {
  for (const Meaning& row : kMeanings)
    if ((code & row.mask) == row.code) return row.words;
  return "a code that CiA 301 reserves";
}

}  // namespace cbcan::descriptions
