// SPDX-License-Identifier: MIT
// What Lua devices cost: 127 nodes whose script is called 100 times a second. Prints how much faster than
// real time virtual time passes, and what one call costs.
//
//   scripts FILE.eds [SECONDS]

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <sstream>

#include "devices/lua/lua_device.hpp"
#include "eds/dictionary_image.hpp"
#include "eds/eds_reader.hpp"
#include "sim/world.hpp"

namespace {

using namespace cbcan;

constexpr std::uint8_t kNodes = 127;
constexpr unsigned kCallsPerSecond = 100;

/// A first order lag of an input, with a switch at a limit.
constexpr const char* kScript = R"(
local value, since = 0, 0
function update(now)
  local wanted = 100 * math.sin(now)
  value = wanted + (value - wanted) * math.exp(since - now)
  since = now
  set(0x2002, 0, 1000 + value * 10)
  if value > 50 and get(0x2001) == 0 then set(0x2001, 0, 1) elseif value < 40 then set(0x2001, 0, 0) end
  return now + 0.01
end
)";

}  // namespace

int main(int count, char** arguments) {
  std::ifstream file(count > 1 ? arguments[1] : "");
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) return std::fprintf(stderr, "scripts: the first argument is plants/demo/generic.eds\n"), 2;
  const unsigned seconds = count > 2 ? static_cast<unsigned>(std::atoi(arguments[2])) : 60;
  sim::World world;
  for (std::uint8_t id = 1; id <= kNodes; ++id) {
    sim::NodeParts parts;
    parts.node_id = id;
    parts.image = eds::dictionary_image(eds::read(text.str(), "", id).device);
    parts.behaviour = [](sim::DeviceNode& node, std::uint64_t seed) {
      return devices::make_lua_device(node, seed, "bench.lua", kScript);
    };
    world.add_node(std::move(parts));
  }
  world.start(0);
  const std::clock_t begun = std::clock();
  world.advance(seconds * kSecond);
  const double took = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
  const bool all_run = world.nodes().back()->device().dictionary().get(0x2002, 0) > 0;
  std::printf("%u nodes, %u calls a second each: %.0f times real time, %.2f us a call\n", kNodes,
              kCallsPerSecond, seconds / took, took * 1e6 / (double{kNodes} * kCallsPerSecond * seconds));
  return all_run ? 0 : 1;
}
