// SPDX-License-Identifier: MIT
#pragma once

/// A device with any dictionary that cbcan-eds has made, as on a board: with parameters in "flash", which
/// outlives it. Freestanding: for the host and for an image.

#include <array>

#include "boards/common/parameter_store.hpp"
#include "cbcan/canopen/eds_device.hpp"

namespace cbcan::test {

class RamFlash final : public boards::Flash {
 public:
  RamFlash() { clear(); }
  void clear() {
    for (auto& words : sectors_)
      words.fill(kErased);
  }
  std::span<const std::uint32_t> sector(std::size_t number) const override { return sectors_[number]; }
  bool write(std::size_t sector, std::size_t word, std::span<const std::uint32_t> unit) override {
    sectors_[sector][word] = unit[0];
    return true;
  }
  bool erase(std::size_t sector) override {
    sectors_[sector].fill(kErased);
    return true;
  }

 private:
  std::array<std::array<std::uint32_t, 8192>, 2> sectors_;
};

class AnyDevice final : public EdsDevice {
 public:
  using EdsDevice::EdsDevice;
};

class StoredDevice {
 public:
  StoredDevice(const EdsDictionary& dictionary, RamFlash& flash, CanPort& port)
      : device(dictionary, std::span(values_).first(dictionary.value_bytes),
               {std::span(buffer_).first(dictionary.largest_value),
                {std::span(rpdos_).first(dictionary.rpdos), std::span(tpdos_).first(dictionary.tpdos),
                 std::span(pieces_).first((dictionary.rpdos + dictionary.tpdos) * dictionary.objects_of_pdo)},
                std::span(watched_).first(dictionary.watched_nodes)},
               port),
        store_(
            flash, settings_, [](std::span<const std::uint16_t>) { return true; }, device) {}

  void start(Time now) {
    store_.start(false);
    device.keep_in(store_);
    device.start(static_cast<std::uint8_t>(settings_[1]), now);
  }

 private:
  std::array<std::uint8_t, 4096> values_{};
  std::array<std::uint8_t, 2048> buffer_{};
  std::array<Pdo::Rpdo, 8> rpdos_{};
  std::array<Pdo::Tpdo, 8> tpdos_{};
  std::array<PdoMapping::Piece, 1024> pieces_{};
  std::array<HeartbeatConsumer::Watched, 128> watched_{};
  std::array<std::uint16_t, 2> settings_{500, 5};

 public:
  AnyDevice device;

 private:
  boards::ParameterStore store_;
};

}  // namespace cbcan::test
