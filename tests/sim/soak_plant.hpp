// SPDX-License-Identifier: MIT
#pragma once

/// The nodes of the soak test, which record what is executed, with random faults and restarts.

#include <cstddef>

#include "scenario/search/rules.hpp"
#include "support/register_file.hpp"
#include "support/world_bench.hpp"

namespace cbcan::test {

using Bytes = std::vector<std::uint8_t>;

/// Only kinds whose changes of a value can be detected: not requests that come late or twice, an inverted
/// bit, or a second node with the same ID.
inline constexpr const char* kOfNode[] = {
    "response-never",
    "response-late delay_ms=%",
    "response-twice",
    "response-out-of-order delay_ms=%",
    "response-other-toggle",
    "response-other-specifier",
    "response-other-index",
    "response-other-size index=0x2010 step=initiate",  // together with that of a segment the sum would be
                                                       // right
    "response-other-size index=0x2011 step=segment",
    "response-other-crc",
    "response-other-sequence",
    "abort code=0x08000021",
    "abort code=0x05040001 step=segment",
    "short-frame",
    "refuse code=0x08000021",
    "silent",
    "heartbeat-stops",
    "state-wrong",
    "boot-up-storm interval_ms=%",
    "emcy-storm interval_ms=%",
};
inline constexpr const char* kOfBus[] = {
    "frame-loss",
    "frame-twice first_id=0x580 last_id=0x5FF",
    "frame-late delay_ms=% first_id=0x580 last_id=0x5FF",
};
inline constexpr const char* kStates[] = {"bus-off", "error-passive", "overflow", "bus-load percent=50",
                                          "bus-load percent=100"};

/// Objects of PLC 0 or 1 in each node: numbers at 2000h + PLC, bytes of any length at 2010h + PLC. A clock
/// makes old responses detectable.
struct SoakObjects {
  static constexpr std::uint16_t kClock = 0x1FFF;
  static constexpr std::uint16_t kNumbers = 0x2000;
  static constexpr std::uint16_t kTexts = 0x2010;
  static constexpr std::uint8_t kSubs = 4;
  static constexpr std::uint16_t kMostBytes = 128;
  static constexpr std::size_t kBytesAtFirst = 8;
};

/// The value of write number `id` of a PLC: the number, low byte first, and bytes calculated from it.
inline Bytes written_by(std::uint32_t id, std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i)
    bytes[i] = static_cast<std::uint8_t>(i < 4 ? id >> 8 * i : id * 31 + i * 7);
  return bytes;
}

/// What the nodes of one network have executed.
struct Executed {
  std::array<std::uint32_t, 2> last{};  ///< number of the last write by PLC
  std::uint64_t writes = 0;
  std::uint64_t again = 0;  ///< writes that were executed twice, or after a later one
  std::uint64_t torn = 0;   ///< bytes that no PLC has written
};

/// The behaviour of a node, which records what is stored.
struct Witness final : sim::Behaviour {
  explicit Witness(sim::DeviceNode& node) : node_(node) {}

  Time update(Time now) override {
    node_.dictionary().set(SoakObjects::kClock, 0, static_cast<std::uint32_t>(now));
    return kNever;
  }

  void reset(bool application, Time now) override {
    if (!application) return;
    for (const std::uint16_t plc : {std::uint16_t{0}, std::uint16_t{1}}) {
      for (std::uint8_t sub = 1; sub <= SoakObjects::kSubs; ++sub) {
        change(static_cast<std::uint16_t>(SoakObjects::kNumbers + plc), sub, written_by(0, 4), now);
        change(static_cast<std::uint16_t>(SoakObjects::kTexts + plc), sub,
               written_by(0, SoakObjects::kBytesAtFirst), now);
      }
    }
  }

  AbortCode check(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                  Time now) override {
    if (entry.index < SoakObjects::kNumbers || executed == nullptr) return AbortCode::kNone;
    std::uint32_t id = 0;
    for (std::size_t i = 0; i < 4 && i < value.size(); ++i)
      id |= std::uint32_t{value[i]} << 8 * i;
    const Bytes bytes(value.begin(), value.end());
    std::uint32_t& last = executed->last.at(entry.index % 2);
    executed->again += id <= last;
    executed->torn += bytes != written_by(id, bytes.size());
    ++executed->writes;
    last = id;
    change(entry.index, sub, bytes, now);
    return AbortCode::kNone;
  }

  /// The object has these bytes, or had them since the request began.
  bool had(std::uint16_t index, std::uint8_t sub, const Bytes& bytes, Time begun) const {
    const auto& [value, seen] = objects_.at({index, sub});
    return value == bytes || seen.has_since(begun, bytes);
  }

  Executed* executed = nullptr;

 private:
  void change(std::uint16_t index, std::uint8_t sub, const Bytes& bytes, Time now) {
    auto& [value, seen] = objects_[{index, sub}];
    seen.add(now, value);
    value = bytes;
  }

  sim::DeviceNode& node_;
  std::map<std::pair<std::uint16_t, std::uint8_t>, std::pair<Bytes, search::ValuesSeen>> objects_;
};

/// One CAN network with a module, three nodes, faults and restarts.
struct SoakNetwork final : private sim::FaultListener {
  static constexpr std::array<std::uint8_t, 3> kNodes{5, 6, 7};

  SoakNetwork(std::uint64_t seed, std::uint32_t bit_rate, std::uint16_t timeout_ms)
      : bit_rate_(bit_rate), timeout_ms_(timeout_ms), random_(seed) {
    power_on();
  }

  Time next() const { return std::min({world_->next_deadline(), fault_due_, restart_due_}); }
  void advance(Time to) {
    now = to;
    world_->advance(now);
    if (now >= fault_due_) change_faults();
    if (now >= restart_due_) power_on();
  }

  /// One Modbus request of a PLC has written these registers.
  void written(std::size_t first, std::size_t count) {
    world_->advance(now);
    module_->on_plc(1, first, count, now);
    module_->on_registers_written(first, count, now);
    world_->advance(now);
  }

  const Witness& node(std::uint8_t id) const { return *witnesses_.at(id); }

  /// No fault has been active since `begin` or shortly before it.
  bool quiet_since(Time begin) const { return open_ == 0 && harmed_at_ + kReach < begin; }
  void harm() { harmed_at_ = now; }

  RegisterFile registers;
  Executed executed;
  Time now = 0;
  std::uint64_t fired = 0;
  std::uint64_t lives = 0;  ///< starts of the module

 private:
  static constexpr Time kReach = 10 * kSecond;

  /// Switches everything but the PLCs off and on.
  void power_on() {
    ++lives;
    world_.reset();
    registers = {};
    open_ = 0;
    harm();
    sim::FaultListener* const listener = this;
    world_ = std::make_unique<sim::World>(bit_rate_, random_.next(), listener);
    module_ = &world_->add_module(registers.window(), registers.process(), {.sdo_timeout_ms = timeout_ms_},
                                  std::array{registers.scanner()});
    for (const std::uint8_t id : kNodes)
      add_node(id);
    world_->start(now);
    fault_due_ = now + kReach + random_.below(90) * kSecond;
    restart_due_ = now + (60 + random_.below(1800)) * kSecond;
  }

  void add_node(std::uint8_t id) {
    sim::NodeParts parts;
    parts.node_id = id;
    parts.image = image();
    parts.behaviour = behaves_as<Witness>;
    parts.seed = random_.next();
    parts.listener = this;
    auto& witness = static_cast<Witness&>(world_->add_node(std::move(parts)).behaviour());
    witness.executed = &executed;
    witnesses_[id] = &witness;
  }

  static descriptions::DictionaryImage image() {
    using enum DataType;
    using Soak = SoakObjects;
    constexpr std::uint16_t kRead = ObjectFlags::kRead,
                            kVariable = ObjectFlags::kReadWrite | ObjectFlags::kVariable;
    descriptions::DictionaryImage image =
        image_of({{0x1000, 0, 0, kUnsigned32, 0, kRead},
                  {0x1001, 0, 0, kUnsigned8, 0, kRead},
                  {0x1017, 0, 0, kUnsigned16, 1000},
                  {Soak::kClock, 0, 0, kUnsigned32, 0, kRead},
                  {Soak::kNumbers, 1, Soak::kSubs, kUnsigned32},
                  {Soak::kNumbers + 1, 1, Soak::kSubs, kUnsigned32},
                  {Soak::kTexts, 1, Soak::kSubs, kOctetString, 0, kVariable, false, Soak::kMostBytes},
                  {Soak::kTexts + 1, 1, Soak::kSubs, kOctetString, 0, kVariable, false, Soak::kMostBytes}});
    ObjectDictionary dictionary(image.entries, image.values, nullptr);
    for (const std::uint16_t plc : {std::uint16_t{0}, std::uint16_t{1}})
      for (std::uint8_t sub = 1; sub <= Soak::kSubs; ++sub)
        dictionary.write(static_cast<std::uint16_t>(Soak::kTexts + plc), sub,
                         written_by(0, Soak::kBytesAtFirst), 0);
    return image;
  }
  /// A delay is shorter than the module's quarantine for a node after a cancelled request.
  std::string random_fault(bool of_bus) {
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
  /// One fault at a time, since two delays would add up.
  void change_faults() {
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
  void on_fault(std::string_view text, Time /*at*/) override {
    ++fired;
    harm();
    if (text.ends_with(": begins")) ++open_;
    if (text.ends_with(": ends")) --open_;
  }

  std::uint32_t bit_rate_;
  std::uint16_t timeout_ms_;
  sim::Random random_;
  std::unique_ptr<sim::World> world_;
  sim::CoprocessorModule* module_ = nullptr;
  std::map<std::uint8_t, Witness*> witnesses_;
  Time fault_due_ = 0;
  Time restart_due_ = 0;
  Time harmed_at_ = 0;
  int open_ = 0;  ///< states that hold
};

}  // namespace cbcan::test
