// SPDX-License-Identifier: MIT
#include "plant_support.hpp"

#include "support/catch.hpp"

namespace cbcan::config::test {

Lines to_lines(const Diagnostics& diagnostics) {
  Lines lines;
  for (const Diagnostic& diagnostic : diagnostics)
    lines.push_back(to_string(diagnostic));
  return lines;
}

Plant read(std::string_view text) {
  Plant plant;
  plant.errors = to_lines(read_plant(text, "plant.toml", plant.config));
  return plant;
}

Start start(const std::vector<const char*>& arguments, const Files& files) {
  std::vector<const char*> argv{"cbcan-sim"};
  for (const char* argument : arguments)
    argv.push_back(argument);
  const cbcan::base::FileReader disk = [&files](const std::string& path) -> std::optional<std::string> {
    const auto file = files.find(path);
    return file == files.end() ? std::nullopt : std::optional(file->second);
  };
  return parse_command_line(static_cast<int>(argv.size()), argv.data(), with_demo_plant(disk));
}

std::string refusal(const std::vector<const char*>& arguments, const Files& files) {
  const Start refused = start(arguments, files);
  CHECK_FALSE(refused.run);
  CHECK(refused.exit_code == ExitCode::kUsage);
  CHECK(refused.out == "");
  return refused.err;
}

NodeConfig node_config(std::uint8_t id, std::string name, std::string eds, std::vector<InitialValue> objects,
                       Place place) {
  NodeConfig node;
  node.id = id;
  node.name = std::move(name);
  node.eds = std::move(eds);
  node.objects = std::move(objects);
  node.place = std::move(place);
  return node;
}

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

}  // namespace cbcan::config::test
