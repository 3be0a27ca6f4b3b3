// SPDX-License-Identifier: MIT
// A device of each file behaves on the bus as the simulated node of the same file: values, abort codes, PDOs,
// what is stored and what is restored.

#include "dictionary/host_buses.hpp"
#include "dictionary/script.hpp"

namespace cbcan::test {

namespace {

/// The first difference, with what led to it.
std::string difference(const Frames& simulated, const Frames& device) {
  const auto [a, b] = std::mismatch(simulated.begin(), simulated.end(), device.begin(), device.end());
  if (a == simulated.end() && b == device.end()) return {};
  const auto before = a - std::min<std::ptrdiff_t>(a - simulated.begin(), 45);
  std::string text;
  for (auto line = before; line != a; ++line)
    text += *line + "\n";
  return text + "simulated: " + (a == simulated.end() ? "nothing" : *a) +
         ", device: " + (b == device.end() ? "nothing" : *b);
}

template <class... Scripts>
void compare(Scripts... scripts) {
  SimulatedBus simulated;
  DeviceBus device;
  std::size_t frames = 0;
  for (std::size_t file = 0; file < std::size(dictionaries::kFiles); ++file) {
    INFO(dictionaries::kFiles[file].path);
    const descriptions::DictionaryImage image = image_of(file);
    CHECK(difference(simulated.power_on(file), device.power_on(file)) == "");
    const auto play = [&](auto script) {
      const Frames expected = script(simulated, image);
      frames += expected.size();
      CHECK(difference(expected, script(device, image)) == "");
    };
    (play(scripts), ...);
  }
  CHECK(frames > 900);
  std::cout << "figure: frames: " << frames << "\n";
}

constexpr auto kReadAll = [](Bus& bus, const descriptions::DictionaryImage& image) {
  return read_all(bus, image);
};

}  // namespace

TEST_CASE("A device of each file reads as the simulated node") {
  compare(kReadAll);
}

TEST_CASE("A device of each file accepts and rejects the same writes") {
  compare(write_all);
}

TEST_CASE("A device of each file maps the same objects, and exchanges the same data") {
  compare(map_all);
}

TEST_CASE("A device of each file stores and restores the same values") {
  compare(write_all, store_all);
}

TEST_CASE("A device of each file takes another node ID from LSS") {
  compare(change_node_id);
}

}  // namespace cbcan::test
