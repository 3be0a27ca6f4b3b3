// SPDX-License-Identifier: MIT
#pragma once

#include "descriptions/dictionary_image.hpp"
#include "descriptions/eds_reader.hpp"
#include "sim/behaviour.hpp"
#include "support/catch.hpp"
#include "support/source_file.hpp"

namespace cbcan::test {

/// `count` sub-indices of one index, from 1 on; 0 = only sub-index 0.
struct Objects {
  std::uint16_t index;
  std::uint8_t count;
  DataType type;
};

inline descriptions::DictionaryImage dictionary_of(const std::vector<Objects>& objects) {
  descriptions::DictionaryImage image;
  for (const Objects& each : objects) {
    const auto size = static_cast<std::uint32_t>(size_of(each.type));
    const std::uint8_t first = each.count == 0 ? 0 : 1;
    image.entries.push_back({each.index, first, each.count, each.type, 0, ObjectFlags::kReadWrite,
                             static_cast<std::uint32_t>(image.values.size()), size});
    image.values.resize(image.values.size() + size * (each.count == 0 ? 1 : each.count));
  }
  return image;
}

/// The dictionary of a node of the demo plant, from its EDS file.
inline descriptions::DictionaryImage demo_dictionary(const std::string& file) {
  return descriptions::dictionary_image(
      descriptions::read(source_file("plants/demo/" + file), file, 0x42).device);
}

/// A node driven by the test. It records the device's requests; the test must expect each of them, in order.
template <class Device>
struct Rig final : sim::DeviceNode {
  /// A value set by the plant file.
  struct Value {
    std::uint16_t index;
    std::uint8_t sub;
    std::uint64_t value;
  };
  explicit Rig(descriptions::DictionaryImage image, const std::vector<Value>& values = {})
      : image_(with(std::move(image), values)),
        values_(image_.values),
        dictionary_(image_.entries, values_, nullptr, image_.limits),
        device(*this) {
    device.reset(true, now);
    run();
  }
  Rig(const Rig&) = delete;
  ~Rig() noexcept(false) {
    if (std::uncaught_exceptions() == 0) expect_nothing();
  }

  void run() { next = device.update(now); }
  Rig& write(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
    CAPTURE(index, sub);
    REQUIRE(dictionary_.set(index, sub, value));
    run();
    return *this;
  }
  Rig& input(std::uint16_t index, std::uint8_t sub, double value) {
    CHECK(device.set_input(index, sub, value, now));
    run();
    return *this;
  }
  Rig& state(nmt::State state) {
    device.on_state(state, now);
    run();
    return *this;
  }
  Rig& incident(std::string_view name, bool present) {
    const auto names = device.incidents();
    device.set_incident(static_cast<std::size_t>(std::ranges::find(names, name) - names.begin()), present,
                        now);
    run();
    return *this;
  }
  Rig& reset(bool application) {
    restore_values(image_.entries, image_.values, values_, 0x1000, application ? 0xFFFF : 0x1FFF);
    device.reset(application, now);
    run();
    return *this;
  }
  /// Lets time pass, with every update that the device requests in between.
  Rig& pass(Time duration) {
    const Time end = now + duration;
    while (next <= end) {
      now = std::max(now, next);
      run();
    }
    now = end;
    return *this;
  }

  std::uint64_t get(std::uint16_t index, std::uint8_t sub) const { return dictionary_.get(index, sub); }
  Rig& shows(std::uint16_t index, std::uint8_t sub, std::uint64_t value, int line = __builtin_LINE()) {
    INFO("in line " << line << ", object " << std::hex << index);
    CHECK(get(index, sub) == value);
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
    if (asked_.empty()) {
      FAIL_CHECK("the device asks for nothing; expected " << wanted);
      return *this;
    }
    CHECK(asked_.front() == wanted);
    asked_.pop_front();
    if constexpr (sizeof...(more) != 0) expect(more...);
    return *this;
  }
  void expect_nothing() {
    for (const std::string& left : asked_)
      FAIL_CHECK("left over: " << left);
    asked_.clear();
  }

  ObjectDictionary& dictionary() override { return dictionary_; }
  void error(std::uint16_t code, std::uint8_t register_bits, const sim::EmergencyInfo& /*info*/,
             Time at) override {
    note("error " + hex(code, 4) + " " + hex(register_bits, 2), at);
  }
  void error_over(std::uint16_t code, Time at) override { note("over " + hex(code, 4), at); }
  void changed(std::uint16_t index, std::uint8_t sub, Time at) override {
    note("changed " + hex(index, 4) + ":" + hex(sub, 2), at);
  }

 private:
  static descriptions::DictionaryImage with(descriptions::DictionaryImage image,
                                            const std::vector<Value>& values) {
    ObjectDictionary dictionary(image.entries, image.values, nullptr);
    for (const Value& value : values)
      REQUIRE(dictionary.set(value.index, value.sub, value.value));
    return image;
  }
  static std::string hex(unsigned number, int digits) {
    char text[16];
    std::snprintf(text, sizeof text, "%0*X", digits, number);
    return text;
  }
  void note(const std::string& asked, Time at) {
    asked_.push_back(asked);
    CHECK(at == now);
  }

  descriptions::DictionaryImage image_;
  std::vector<std::uint8_t> values_;
  ObjectDictionary dictionary_;
  std::deque<std::string> asked_;

 public:
  Time now = 1000;
  Time next = kNever;
  Device device;
};

}  // namespace cbcan::test
