// SPDX-License-Identifier: MIT
#include "sim/soak_plant.hpp"

#include <stdexcept>

namespace cbcan::test {

namespace {

void append(Bytes& values, const Bytes& more, std::size_t size) {
  values.insert(values.end(), more.begin(), more.end());
  values.resize(values.size() + size - more.size());
}

/// Kinds that cannot change a value so that nobody could notice: a request that comes late or twice, an
/// inverted bit and a second node with the same ID can.
constexpr const char* kOfNode[] = {
    "response-never",
    "response-late delay_ms=%",
    "response-twice",
    "response-out-of-order delay_ms=%",
    "response-other-toggle",
    "response-other-specifier",
    "response-other-index",
    "response-other-size index=0x2010 step=initiate",  // with that of a segment too the sum would be right
    "response-other-size index=0x2011 step=segment",
    "response-other-crc",
    "response-other-sequence",
    "abort code=0x08000021",
    "abort code=0x05040001 step=segment",
    "short-frame",
    "silent",
    "heartbeat-stops",
    "state-wrong",
    "boot-up-storm interval_ms=%",
    "emcy-storm interval_ms=%",
};
constexpr const char* kOfBus[] = {
    "frame-loss",
    "frame-twice first_id=0x580 last_id=0x5FF",
    "frame-late delay_ms=% first_id=0x580 last_id=0x5FF",
};
constexpr const char* kStates[] = {"bus-off", "error-passive", "overflow", "bus-load percent=50",
                                   "bus-load percent=100"};

}  // namespace

sim::NodeImage SoakNetwork::image() {
  using Flags = ObjectFlags;
  sim::NodeImage image;
  const auto add = [&image](std::uint16_t index, std::uint8_t first, std::uint8_t last, DataType type,
                            std::uint16_t flags, std::uint32_t capacity, const Bytes& value) {
    const std::uint32_t front = (flags & Flags::kVariable) != 0 ? ObjectEntry::kLengthBytes : 0;
    const auto offset = static_cast<std::uint32_t>(image.values.size()) + front;
    image.entries.push_back({index, first, last, type, 0, flags, offset, capacity});
    for (unsigned sub = first; sub <= last; ++sub) {
      if (front != 0) append(image.values, {static_cast<std::uint8_t>(value.size()), 0, 0, 0}, front);
      append(image.values, value, capacity);
    }
  };
  add(0x1000, 0, 0, DataType::kUnsigned32, Flags::kRead, 4, {});
  add(0x1001, 0, 0, DataType::kUnsigned8, Flags::kRead, 1, {});
  add(0x1017, 0, 0, DataType::kUnsigned16, Flags::kReadWrite, 2, {0xE8, 0x03});
  add(SoakObjects::kClock, 0, 0, DataType::kUnsigned32, Flags::kRead, 4, {});
  for (const std::uint16_t plc : {std::uint16_t{0}, std::uint16_t{1}})
    add(static_cast<std::uint16_t>(SoakObjects::kNumbers + plc), 1, SoakObjects::kSubs, DataType::kUnsigned32,
        Flags::kReadWrite, 4, written_by(0, 4));
  for (const std::uint16_t plc : {std::uint16_t{0}, std::uint16_t{1}})
    add(static_cast<std::uint16_t>(SoakObjects::kTexts + plc), 1, SoakObjects::kSubs, DataType::kOctetString,
        Flags::kReadWrite | Flags::kVariable, SoakObjects::kMostBytes,
        written_by(0, SoakObjects::kBytesAtFirst));
  return image;
}

/// A delay is shorter than the time for which the module keeps away from a node after a cancelled request.
std::string SoakNetwork::random_fault(bool of_bus) {
  const auto one_of = [this](auto& texts) {
    return std::string(texts[random_.below(static_cast<std::uint32_t>(std::size(texts)))]);
  };
  const bool state = random_.below(5) == 0;
  std::string text = state ? one_of(kStates) : of_bus ? one_of(kOfBus) : one_of(kOfNode);
  if (text.starts_with("bus-load") && !of_bus) text = "bus-off";
  if (const std::size_t at = text.find('%'); at != std::string::npos)
    text.replace(at, 1, std::to_string(1 + random_.below(950)));
  text += " until_ms=" + std::to_string(500 + random_.below(9500));
  if (!state) text += random_.below(2) == 0 ? "" : " probability=0.1";
  return text;
}

/// One at a time: two delays would add up.
void SoakNetwork::change_faults() {
  const std::uint32_t place = random_.below(4);
  const bool of_bus = place == 3;
  world_->faults().clear(now);
  for (const auto& node : world_->nodes())
    node->faults().clear(now);
  sim::FaultSet& set = of_bus ? world_->faults() : world_->nodes()[place]->faults();
  const auto parsed =
      sim::parse_fault(random_fault(of_bus), of_bus ? sim::FaultPlace::kBus : sim::FaultPlace::kNode);
  if (!parsed.problem.empty()) throw std::invalid_argument(parsed.problem);
  set.add(parsed.fault, now);
  harm();
  fault_due_ = now + (15 + random_.below(120)) * kSecond;
}

void SoakNetwork::on_fault(std::string_view text, Time /*at*/) {
  ++fired;
  harm();
  if (text.ends_with(": begins")) ++open_;
  if (text.ends_with(": ends")) --open_;
}

}  // namespace cbcan::test
