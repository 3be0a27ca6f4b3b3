// SPDX-License-Identifier: MIT
#include "descriptions/generators.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/command.hpp"
#include "descriptions/dictionary_image.hpp"
#include "descriptions/network_file.hpp"

namespace cbcan::descriptions {

namespace {

using base::setting;
using base::UsageError;

struct Options {
  std::string file;
  std::string name;
  std::string output;
  std::string depfile;
  bool binary = false;
  std::uint8_t own_node = 127;
  std::uint16_t pdos = kServices.rpdos;
};

std::string file_name(const std::string& path) {
  return path.substr(path.rfind('/') + 1);
}

std::string dictionary_of(const Options& options, const base::FileReader& read, Generated& made) {
  const std::string& file = options.file;
  if (file.ends_with('/')) throw UsageError(file + ": this is a folder; name a file in it");
  const auto content = read(file);
  if (!content) throw UsageError("cannot read " + file + "; check the path and its permissions");
  const std::string name = file_name(file);
  return dictionary_header(
      *content, file, options.name.empty() ? name.substr(0, name.rfind('.')) : options.name, made.remarks);
}

std::string escaped(std::string name) {
  for (std::size_t at = 0; (at = name.find(' ', at)) != std::string::npos; at += 2)
    name.insert(at, 1, '\\');
  return name;
}

void check_pdos(const PlannedNetwork& network, const Options& options) {
  for (const PlannedNode& node : network.all)
    for (const PlannedPdo& pdo : node.pdos)
      if (pdo.own > options.pdos || pdo.at >= kFurtherAt)
        throw UsageError(fmt::format("{}:{}: node {}: the image has {} PDOs, in R3800..R3927; see --pdos",
                                     options.file, pdo.line, node.id, options.pdos));
}

std::string network_of(const Options& options, const base::FileReader& read, Generated& made) {
  std::string rule = escaped(options.output) + ":";
  const auto noted = [&](const std::string& name) {
    auto content = read(name);
    if (content) rule += " " + escaped(name);
    return content;
  };
  const PlannedNetwork network = read_network(options.file, noted, made.remarks);
  check_pdos(network, options);
  const Bytes image = image_of(network, options.own_node, options.file);
  if (!options.depfile.empty()) made.files.push_back({options.depfile, rule + "\n"});
  return options.binary ? std::string(image.begin(), image.end()) : header_of(image, file_name(options.file));
}

// ---- Command lines

// clang-format off
constexpr auto kOutput = setting<&Options::output>({.option = "--output FILE", .help = "Writes FILE instead of standard output"});
constexpr std::array kEdsWords{setting<&Options::file>({.option = "FILE", .help = "EDS or DCF file"})};
constexpr std::array kEdsOptions{
    setting<&Options::name>({.option = "--name NAME", .help = "Namespace of the header (default: the file's name)"}), kOutput};
constexpr std::array kNetworkWords{setting<&Options::file>({.option = "NETWORK", .help = "Network file"})};
constexpr std::array kNetworkOptions{
    setting<&Options::binary>({.option = "--binary", .help = "Prints the bytes alone, for a part of the flash"}),
    setting<&Options::depfile>({.option = "--depfile FILE", .help = "Writes a rule of make: the file of --output depends on all files read"}),
    setting<&Options::own_node>({.option = "--own-node N", .help = "Node ID of the module itself", .low = 1, .high = 127}),
    setting<&Options::pdos>({.option = "--pdos N", .help = "RPDOs and TPDOs that the image has"}), kOutput};
constexpr base::Command<Options> kEds{
    "cbcan-eds", "prints the object dictionary of an EDS or DCF file as a C++ header", kEdsWords, kEdsOptions};
constexpr base::Command<Options> kNetwork{
    "cbcan-network", "prints a network as a C++ header that defines kNetwork", kNetworkWords, kNetworkOptions};
// clang-format on

}  // namespace

Generated generate(std::span<const char* const> words, const base::FileReader& read) {
  const bool is_eds = words.front() == kEds.name;
  const base::Command<Options>& command = is_eds ? kEds : kNetwork;
  const base::ParsedArguments typed = base::parse_arguments(words.subspan(1), command);
  if (is_typed(typed, base::kHelpOption)) return {help_of(command), {}, {}, base::ExitCode::kDone};
  try {
    Options options;
    const base::Problem problem = put_all(command, typed, options);
    if (!problem.empty()) throw UsageError(fmt::format("{}; see {} --help", problem, command.name));
    Generated made;
    std::string output = is_eds ? dictionary_of(options, read, made) : network_of(options, read, made);
    if (options.output.empty())
      made.out = std::move(output);
    else
      made.files.push_back({options.output, std::move(output)});
    return made;
  } catch (const std::exception& error) {
    return {{}, {fmt::format("{}: {}", command.name, error.what())}, {}, base::ExitCode::kUsage};
  }
}

}  // namespace cbcan::descriptions
