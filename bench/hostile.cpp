// SPDX-License-Identifier: MIT
// The calls of one script of tests/scenario/hostile_scripts.hpp, for bench/instructions_host to count.
// Without the number of one: how many there are.
//
//   hostile FILE.eds [NUMBER]

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "devices/lua/lua_device.hpp"
#include "eds/dictionary_image.hpp"
#include "eds/eds_reader.hpp"
#include "plant/hostile_scripts.hpp"
#include "sim/world.hpp"

int main(int count, char** arguments) {
  using namespace cbcan;
  if (count < 3) return std::printf("%zu\n", test::kHostile.size()), 0;
  std::ifstream file(arguments[1]);
  std::ostringstream text;
  text << file.rdbuf();
  sim::World world;
  sim::NodeParts parts;
  parts.node_id = 1;
  parts.image = eds::dictionary_image(eds::read(text.str(), "", 1).device);
  parts.behaviour = [&](sim::DeviceNode& node, std::uint64_t seed) {
    const auto number = static_cast<std::size_t>(std::atoi(arguments[2]));
    return devices::make_lua_device(node, seed, "t.lua", test::text_of(test::kHostile.at(number)));
  };
  world.add_node(std::move(parts));
  world.start(0);
}
