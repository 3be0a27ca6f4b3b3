// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/read_file.hpp"
#include "base/text.hpp"
#include "cbcan/sim.hpp"
#include "config/plant_file.hpp"
#include "plant/command_words.hpp"
#include "plant/plant.hpp"
#include "sim/frame_text.hpp"

namespace cbcan {

namespace {

std::optional<std::string> read_disk(const std::string& path) try {
  return base::read_file(path);
} catch (const std::runtime_error& error) {
  throw PlantError(error.what());
}

base::FileReader reader() {
  return config::with_demo_plant(read_disk);
}

[[noreturn]] void throw_plant_error(const std::vector<std::string>& lines) {
  throw PlantError(fmt::format("{}", fmt::join(lines, "\n")));
}

config::Config config_of(std::string_view text, const std::string& file) {
  config::Config config;
  config::Diagnostics problems = config::read_plant(text, file, config);
  if (problems.empty()) problems = config::check(config);
  const auto line_of = [](const config::Diagnostic& problem) { return to_string(problem); };
  if (!problems.empty()) throw_plant_error(base::column(problems, line_of));
  return config;
}

config::PlantBuild build_of(const config::Config& config, const Plant::Devices& devices) {
  config::PlantBuild build = config::build_nodes(config, reader());
  if (!build.good) throw_plant_error(build.lines);
  const auto& nodes = config.networks.front().nodes;
  for (const auto& [id, make] : devices) {
    const auto found = std::ranges::find(nodes, id, &config::NodeConfig::id);
    if (found == nodes.end()) throw PlantError(fmt::format("device of node {}: there is no such node", id));
    build.networks.front()[static_cast<std::size_t>(found - nodes.begin())].behaviour = make;
  }
  return build;
}

/// Throws an error response, returns any other.
std::string checked(std::string response) {
  if (response.starts_with(plant::kError))
    throw PlantError(std::string(base::trim(response.substr(plant::kError.size()))));
  return response;
}

}  // namespace

struct Plant::Inside {
  Inside(const config::Config& config, const Devices& devices) : plant(config, build_of(config, devices)) {
    plant.start();
  }

  plant::VirtualPlant plant;
  plant::LastFrames frames{plant.view(), 100'000};
};

Plant::Plant(std::unique_ptr<Inside> inside) : inside_(std::move(inside)) {}
Plant::Plant(Plant&& other) noexcept = default;
Plant& Plant::operator=(Plant&& other) noexcept = default;
Plant::~Plant() = default;

Plant Plant::from_file(const std::string& path, const Devices& devices) {
  const auto text = reader()(path);
  if (!text) throw PlantError(path + ": cannot be read; check the path and its permissions");
  return Plant(std::make_unique<Inside>(config_of(*text, path), devices));
}

Plant Plant::from_text(std::string_view toml, const std::string& folder, const Devices& devices) {
  return Plant(std::make_unique<Inside>(config_of(toml, folder + "/text"), devices));
}

Plant Plant::demo() {
  return from_file(std::string(config::kDemoPlant));
}

void Plant::write(std::uint16_t first, const Words& words, unsigned unit) {
  command(fmt::format("write {}/{} {}", unit, first, base::joined(words)));
}

Plant::Words Plant::registers(std::uint16_t first, std::size_t count, unsigned unit) try {
  if (unit < 1 || unit > inside_->plant.view().networks())
    throw plant::Refused(fmt::format("unit {}: there are 1..{}", unit, inside_->plant.view().networks()));
  return inside_->plant.view().read(unit, first, count);
} catch (const plant::Refused& refused) {
  throw PlantError(refused.what());
}

Plant::Duration Plant::now() const {
  return Duration(inside_->plant.now());
}

void Plant::advance(Duration duration) {
  inside_->plant.advance_to(inside_->plant.now() + static_cast<Time>(duration.count()));
}

std::string Plant::command(std::string_view line) {
  const std::string response = checked(inside_->plant.execute(line));
  const auto [lines, last] = plant::parts_of(response);
  return std::string(lines) += base::trim(last.substr(std::string_view("ok").size()));
}

bool Plant::wait(std::string_view condition, Duration within) {
  const std::string response =
      inside_->plant.execute(fmt::format("wait {} within {}us", condition, within.count()));
  return !response.starts_with(plant::kNotWithin) && !checked(response).empty();
}

bool Plant::holds(std::string_view condition) try {
  return make_condition(condition, inside_->plant.view())->holds(inside_->plant.view());
} catch (const plant::Refused& refused) {
  throw PlantError(refused.what());
}

std::vector<std::string> Plant::frames() {
  std::vector<std::string> texts;
  for (const auto& [network, frame, at] : inside_->frames.take())
    texts.push_back(plant::prefix_of(network) + sim::frame_text(frame));
  return texts;
}

}  // namespace cbcan
