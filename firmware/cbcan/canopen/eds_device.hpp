// SPDX-License-Identifier: MIT
#pragma once

/// A Device with the dictionary of an EDS file (cbcan-eds), its memory, LSS and stored parameters. An
/// application derives from EdsDeviceOf, overrides what it needs of DeviceApplication, and accesses objects
/// by their names:
///
///   class Module final : public cbcan::EdsDeviceOf<module::kDictionary> { ... };
///   Module module(port);
///   module.start(5, now);
///
/// What differs between devices of one image: set() the serial number, 1018h:04, before start(). An override
/// of on_read() is asked for 1018h, the texts 1008h..100Ah and objects that the file has no value for. `out`
/// has the stored value, which is also that of PDOs, and room for 64 bytes of text or more:
///
///   AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
///                     std::size_t& size, Time now) override {
///     if (entry.index != object::kHardwareVersion) return EdsDeviceOf::on_read(entry, sub, out, size, now);
///     std::ranges::copy(revision_, out.begin());
///     size = revision_.size();
///     return AbortCode::kNone;
///   }
///
/// Nothing has to be overridden. An override of on_stored() or on_state() calls the one here first. Nothing
/// blocks, nothing is allocated; not re-entrant.

#include <array>
#include <cstdint>
#include <span>

#include "cbcan/canopen/built_if.hpp"
#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/device_lss.hpp"
#include "cbcan/canopen/dictionary/eds_dictionary.hpp"
#include "cbcan/copy_bytes.hpp"

namespace cbcan {

/// An object with one of these indices is in the dictionary.
constexpr bool describes(const EdsDictionary& dictionary, std::uint16_t first, std::uint16_t last) {
  for (const ObjectEntry& entry : dictionary.entries)
    if (entry.index >= first && entry.index <= last) return true;
  return false;
}

/// What a device with this dictionary keeps in RAM.
template <const EdsDictionary& kDictionary>
struct EdsMemory {
  static_assert(kServices.emergencies ||
                    (!describes(kDictionary, object::kErrorHistory, object::kErrorHistory) &&
                     !describes(kDictionary, object::kEmergencyCobId, object::kEmergencyInhibitTime)),
                "the EDS file has 1003h, 1014h or 1015h, and kServices no emergencies");
  static_assert(kServices.time || !describes(kDictionary, object::kTimeCobId, object::kTimeCobId),
                "the EDS file has 1012h, and kServices no time");
  static_assert(kServices.other_devices || (kDictionary.limits.empty() && kDictionary.watched_nodes == 0),
                "the EDS file has limits or 1016h, and kServices no other_devices");
  static_assert(kServices.process_data() || kDictionary.rpdos + kDictionary.tpdos == 0,
                "the EDS file has PDOs, and kServices none");

  std::array<std::uint8_t, kDictionary.value_bytes> values{};
  std::array<std::uint8_t, kDictionary.largest_value> buffer{};
  std::array<Pdo::Rpdo, kDictionary.rpdos> rpdos{};
  std::array<Pdo::Tpdo, kDictionary.tpdos> tpdos{};
  std::array<PdoMapping::Piece, (kDictionary.rpdos + kDictionary.tpdos) * kDictionary.objects_of_pdo>
      pieces{};
  std::array<HeartbeatConsumer::Watched, kDictionary.watched_nodes> watched{};
};

class EdsDevice : protected DeviceApplication, public PowerOnValues {
 public:
  static constexpr std::uint8_t kNoNodeId = LssSlave::kNoNodeId;

  /// All outlive it. `values`: EdsDictionary::value_bytes zeros.
  template <Services kOf = kServices>
  EdsDevice(const EdsDictionary& dictionary, std::span<std::uint8_t> values, const Device::Storage& storage,
            CanPort& port)
      : dictionary_(dictionary),
        values_(values),
        device_(kNoNodeId, {dictionary.entries, values, dictionary.limits}, storage, *this, port),
        lss_(device_, static_cast<DeviceApplication&>(*this), port) {
    copy_bytes(dictionary.power_on.data(), values.data(), dictionary.power_on.size());
    static_assert(kOf.sdo_server, "an EdsDevice has an SDO server, and kServices none");
  }
  EdsDevice(const EdsDevice&) = delete;
  EdsDevice& operator=(const EdsDevice&) = delete;

  /// Call it before start(): where 1010h and LSS store; without it both are rejected. It outlives the device.
  void keep_in(ParameterMemory& memory) { memory_ = &memory; }
  /// Power on: boot-up message, then Pre-operational. kNoNodeId: waits for an LSS master. With LSS the node
  /// ID comes only from here and from LSS, not from device().set_node_id().
  void start(std::uint8_t node_id, Time now);

  void on_frame(const Frame& frame, Time now);
  void on_bus_state(BusState state, Time now) { device_.on_bus_state(state, now); }
  /// Sends what is due. Returns the time of the next call; kNever = only after another call.
  Time poll(Time now);

  /// A stored number of up to 8 bytes, without its sign's upper bits.
  std::uint64_t get(ObjectAddress object) const { return device_.dictionary().get(object.index, object.sub); }
  /// A change is an event for the TPDOs that map it; the next poll() sends each once. A reset restores the
  /// file's value, unless on_read() is asked for the object and clients cannot write it.
  void set(ObjectAddress object, std::uint64_t value);

  Device& device() { return device_; }
  const Device& device() const { return device_; }

  bool is_power_on(const ObjectDictionary& objects, const ObjectEntry& entry, std::uint8_t sub,
                   std::span<const std::uint8_t> bytes) const override;

 protected:
  ~EdsDevice() = default;

  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override;
  void on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) override;
  void on_state(nmt::State state, Time now) override;

 private:
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;
  bool restore_more(std::uint32_t step, Time now) override;
  ParameterMemory* memory() override { return memory_; }

  const EdsDictionary& dictionary_;
  std::span<std::uint8_t> values_;
  ParameterMemory* memory_ = nullptr;
  Device device_;
  BuiltIf<kServices.lss, DeviceLss> lss_;
};

template <const EdsDictionary& kDictionary>
class EdsDeviceOf : private EdsMemory<kDictionary>, public EdsDevice {
  using Memory = EdsMemory<kDictionary>;

 public:
  explicit EdsDeviceOf(CanPort& port)
      : EdsDevice(kDictionary, Memory::values,
                  {Memory::buffer, {Memory::rpdos, Memory::tpdos, Memory::pieces}, Memory::watched}, port) {}

 protected:
  ~EdsDeviceOf() = default;
};

}  // namespace cbcan
