// SPDX-License-Identifier: MIT
// Any bytes as a network image, constant and in RAM, and objects written to it: what it has is found, and nothing
// outside of it is read or written. The input is a byte, the image's size; the image without its CRC; and objects.

#include <set>

#include "cbcan/canopen/manager/network_objects.hpp"
#include "cbcan/canopen/sdo/crc16.hpp"
#include "fuzz/fuzz.hpp"

namespace cbcan::fuzz {

namespace {

using Bytes = NetworkObjects::Bytes;

constexpr auto kIndices = std::to_array<std::uint16_t>(
    {0x1F22, 0x1F80, 0x1F81, 0x1F84, 0x1F85, 0x1F88, 0x1F89, 0x1F8A, 0x300A, 0x300B, 0x300D, 0x1400, 0x1600});

void read_all(const NetworkObjects& objects) {
  std::set<std::pair<std::uint16_t, std::uint8_t>> seen;
  objects.visit_own([&objects, &seen](const ConciseDcf::Entry& entry) {
    require(!NetworkObjects::is_network(entry.index), "own parameters are no objects of the network");
    if (!seen.emplace(entry.index, entry.sub).second) return;  // the first of them counts
    require(objects.find(entry.index, entry.sub).data() == entry.value.data(), "an object is found");
  });
  for (const std::uint16_t index : kIndices)
    for (unsigned sub = 0; sub < 256; ++sub)
      objects.number(index, static_cast<std::uint8_t>(sub));
}

void write_one(NetworkObjects& objects, Input& input) {
  const std::uint16_t index = input.one_of(kIndices);
  const std::uint8_t sub = input.byte();
  const Bytes value = input.take(input.byte() % 16);
  if (objects.write(index, sub, value) != AbortCode::kNone) return;
  const bool zeros = std::ranges::all_of(value, [](std::uint8_t byte) { return byte == 0; });
  const Bytes found = objects.find(index, sub);
  require(zeros || std::ranges::equal(found, value), "what is written is read");  // the image may have it twice
}

}  // namespace

void run(Input input) {
  // Memory of its own, so that a sanitizer sees its end.
  const Bytes given = input.take(input.byte());
  std::vector<std::uint8_t> image(given.begin(), given.end());
  if (const std::uint16_t crc = crc16(given); !image.empty())
    image.insert(image.end(), {static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8)});
  NetworkObjects constant;
  const bool good = constant.use(Bytes(image));
  read_all(constant);
  require(constant.write(0x1F80, 0, std::array<std::uint8_t, 4>{1}) == AbortCode::kReadOnly, "it is constant");
  std::vector<std::uint8_t> memory = image;
  memory.resize(image.size() + 64);
  NetworkObjects changing;
  require(changing.use(memory, image.size()) == (good || image.empty()), "the same image is good in RAM");
  while (!input.empty())
    write_one(changing, input);
  read_all(changing);
}

}  // namespace cbcan::fuzz
