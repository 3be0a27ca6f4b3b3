// SPDX-License-Identifier: MIT
#pragma once

#include "sim/behaviour.hpp"
#include "support/demo_image.hpp"
#include "support/rows.hpp"

namespace cbcan::test {

/// `count` sub-indices of one index, from 1 on; 0 = only sub-index 0.
struct Objects {
  std::uint16_t index;
  std::uint8_t count;
  DataType type;
};

inline descriptions::DictionaryImage dictionary_of(const std::vector<Objects>& objects) {
  std::vector<ObjectRow> rows;
  for (const auto& [index, count, type] : objects)
    rows.push_back({index, static_cast<std::uint8_t>(count == 0 ? 0 : 1), count, type});
  descriptions::DictionaryImage image;
  image.entries = entries_of(rows);
  image.values = values_of(rows);
  return image;
}

/// A device in virtual time; the test is its node.
template <class Self, class Device>
struct DeviceBench : sim::DeviceNode {
  template <class... More>
  explicit DeviceBench(descriptions::DictionaryImage dictionary, const More&... more)
      : image_(std::move(dictionary)), device(*this, more...) {}
  virtual ~DeviceBench() noexcept(false) {}

  Self& start() {
    device.reset(true, now);
    return update();
  }
  Self& update() {
    deadline = device.update(now);
    REQUIRE(deadline > now);
    if (seen) seen();
    return self();
  }
  /// With every update that the device requests in between.
  Self& pass(Time duration) {
    const Time end = now + duration;
    for (int steps = 0; deadline <= end; ++steps) {
      REQUIRE(steps < 10'000);
      now = std::max(now, deadline);
      update();
    }
    now = end;
    return self();
  }
  Self& state(nmt::State state) {
    device.on_state(state, now);
    return update();
  }
  Self& network_failure(sim::NetworkFailure failure) {
    device.on_network_failure(failure, now);
    return update();
  }
  Self& incident(std::string_view name, bool present) {
    const auto names = device.incidents();
    device.set_incident(static_cast<std::size_t>(std::ranges::find(names, name) - names.begin()), present, now);
    return update();
  }

  ObjectDictionary& dictionary() override { return objects; }
  /// "2310/03", and "2310 over".
  void error(std::uint16_t code, std::uint8_t register_bits, const sim::EmergencyInfo&, Time at) override {
    note(hex(code, 4) + "/" + hex(register_bits, 2), at);
  }
  void error_over(std::uint16_t code, Time at) override { note(hex(code, 4) + " over", at); }

  descriptions::DictionaryImage image_;
  std::vector<std::uint8_t> values_ = image_.values;
  ObjectDictionary objects{image_.entries, values_, nullptr, image_.limits};
  std::function<void()> seen;  ///< called after every update
  std::vector<std::string> log;
  Time now = 1000;
  Time deadline = kNever;
  Device device;

 protected:
  static std::string hex(unsigned number, int digits) {
    char text[16];
    std::snprintf(text, sizeof text, "%0*X", digits, number);
    return text;
  }
  void note(const std::string& asked, Time at) {
    log.push_back(asked);
    CHECK(at == now);
  }

 private:
  Self& self() { return static_cast<Self&>(*this); }
};

/// Records what the device asks for; the test must expect each of it, in order.
template <class Device>
struct Rig final : DeviceBench<Rig<Device>, Device> {
  using Base = DeviceBench<Rig, Device>;
  using Base::device, Base::log, Base::now, Base::objects, Base::update;

  explicit Rig(descriptions::DictionaryImage image, const InitialValues& values = {})
      : Base(with(std::move(image), values)) {
    this->start();
  }
  Rig(const Rig&) = delete;
  ~Rig() noexcept(false) override {
    if (std::uncaught_exceptions() == 0) expect_nothing();
  }

  Rig& write(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
    CAPTURE(index, sub);
    REQUIRE(objects.set(index, sub, value));
    return update();
  }
  Rig& input(std::uint16_t index, std::uint8_t sub, double value) {
    CHECK(device.set_input(index, sub, value, now));
    return update();
  }
  Rig& reset(bool application) {
    restore_values(this->image_.entries, this->image_.values, this->values_, 0x1000,
                   application ? 0xFFFF : 0x1FFF);
    device.reset(application, now);
    return update();
  }

  Rig& shows(std::uint16_t index, std::uint8_t sub, std::uint64_t value, int line = __builtin_LINE()) {
    INFO("in line " << line << ", object " << std::hex << index);
    CHECK(objects.get(index, sub) == value);
    return *this;
  }
  /// For a device with outputs.
  Rig& puts_out(std::uint16_t index, std::uint8_t sub, double value, int line = __builtin_LINE()) {
    INFO("in line " << line << ", output " << std::hex << index);
    CHECK(device.output(index, sub) == value);
    return *this;
  }

  template <class... More>
  Rig& expect(const std::string& wanted, const More&... more) {
    if (log.empty()) {
      FAIL_CHECK("the device asks for nothing; expected " << wanted);
      return *this;
    }
    CHECK(log.front() == wanted);
    log.erase(log.begin());
    if constexpr (sizeof...(more) != 0) expect(more...);
    return *this;
  }
  void expect_nothing() {
    for (const std::string& left : log)
      FAIL_CHECK("left over: " << left);
    log.clear();
  }
  void changed(std::uint16_t index, std::uint8_t sub, Time at) override {
    this->note("changed " + this->hex(index, 4) + ":" + this->hex(sub, 2), at);
  }
};

}  // namespace cbcan::test
