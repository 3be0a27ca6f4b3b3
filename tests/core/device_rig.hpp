// SPDX-License-Identifier: MIT
#pragma once

/// A Device, node 42h, over a dictionary that the test writes down, in virtual time.

#include "cbcan/canopen/device.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

/// One or more sub-indices that are alike, and their power-on value.
struct Row {
  std::uint16_t index;
  std::uint8_t first_sub;
  std::uint8_t last_sub;
  DataType type;
  std::uint64_t value = 0;
  std::uint16_t flags = ObjectFlags::kReadWrite;
};

/// All that a Device acts on, but PDOs.
std::vector<Row> everything();

struct DeviceRig : Wire, private DeviceApplication, private ParameterMemory {
  explicit DeviceRig(const std::vector<Row>& rows);
  virtual ~DeviceRig() noexcept(false) = default;

  /// Lets a frame arrive; then everything that is due now happens.
  Wire& arrive(const std::string& frame);
  /// An expedited SDO download of `size` bytes to the device's object, and the response that it has to give:
  /// "60" done, or an abort code such as "06090030".
  void write(std::uint16_t index, std::uint8_t sub, std::size_t size, std::uint32_t value,
             const std::string& outcome = "done");
  Wire& pass(Time duration);
  /// By SDO, expedited.
  std::uint32_t read(std::uint16_t index, std::uint8_t sub);
  std::uint64_t get(std::uint16_t index, std::uint8_t sub) { return device.dictionary().get(index, sub); }
  /// Power on, with the boot-up message taken off the wire, then Operational if asked for.
  Wire& start(bool operational = false);
  std::vector<std::uint32_t> received_ids() const;

  std::vector<ObjectEntry> entries;
  std::vector<std::uint8_t> power_on;
  std::vector<std::uint8_t> values;
  Time now = 0;
  std::vector<std::string> events;  ///< what the application has heard
  AbortCode keeps = AbortCode::kNone;
  bool has_memory = true;
  unsigned id_changes = 0;  ///< how often it was told that it may have to listen to other CAN-IDs

 private:
  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override;
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time now) override;
  void restore(std::uint16_t first_index, std::uint16_t last_index, Time now) override;
  void on_state(nmt::State state, Time now) override;
  void refresh(Time now) override;
  void on_written(Time now) override;
  void on_sync(Time now) override;
  void on_received_ids() override { ++id_changes; }
  void on_network_failure(NetworkFailure failure, Time now) override;
  ParameterMemory* memory() override { return has_memory ? this : nullptr; }
  AbortCode save(std::uint16_t first_index, std::uint16_t last_index) override;
  AbortCode forget(std::uint16_t first_index, std::uint16_t last_index) override;

  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(64);
  std::vector<Pdo::Rpdo> rpdos_ = std::vector<Pdo::Rpdo>(4);
  std::vector<Pdo::Tpdo> tpdos_ = std::vector<Pdo::Tpdo>(4);
  std::vector<PdoMapping::Piece> pieces_ = std::vector<PdoMapping::Piece>(8 * 64);
  std::vector<HeartbeatConsumer::Watched> watched_ = std::vector<HeartbeatConsumer::Watched>(4);

 public:
  Device device;
};

/// With everything(), and its boot-up message taken off the wire.
struct StartedRig final : DeviceRig {
  explicit StartedRig(bool operational = false) : DeviceRig(everything()) { start(operational); }
};

}  // namespace cbcan::test
