// SPDX-License-Identifier: MIT
// cbcan-network: a network file as the objects of the module, for images of a board.

#include <array>
#include <filesystem>
#include <fstream>

#include "base/read_file.hpp"
#include "base/text.hpp"
#include "descriptions/network_file.hpp"
#include "generator.hpp"

namespace {

using namespace cbcan;
using base::UsageError;

constexpr auto kHelp = R"(usage: cbcan-network [--binary] [--depfile FILE.d] [--own-node N] [--pdos N] NETWORK

  Prints the network as a C++ header that defines kNetwork, for Coprocessor::use_network(). Mistakes and their
  lines are on standard error.

  --binary          prints the bytes alone, for a part of the flash
  --depfile FILE.d  writes a rule of make: FILE depends on all files read
  --own-node N      the module's own node ID (default: 127)
  --pdos N          RPDOs and TPDOs that the image has (default: 16)
)";

std::string escaped(std::string name) {
  for (std::size_t at = 0; (at = name.find(' ', at)) != std::string::npos; at += 2)
    name.insert(at, 1, '\\');
  return name;
}

void write_depfile(const std::string& path, const tools::Words& files) {
  std::ofstream out(path);
  out << escaped(path.substr(0, path.size() - 2)) << ':';
  for (const std::string& file : files)
    out << ' ' << escaped(file);
  if (!(out << std::endl)) throw std::runtime_error(path + ": cannot be written");
}

constexpr std::array<std::string_view, 4> kOptions{"--binary", "--depfile FILE.d", "--own-node N",
                                                   "--pdos N"};

std::string output_of(const base::ParsedArguments& typed, tools::Words& remarks) {
  bool binary = false;
  std::uint8_t own_node = 127;
  unsigned pdos = kServices.rpdos;
  std::string depfile;
  for (const auto& [option, text] : typed.options) {
    if (option == "--binary") {
      binary = true;
    } else if (option == "--depfile") {
      depfile = text;
      if (!text.ends_with(".d")) throw UsageError(depfile + ": must end with .d");
    } else if (option == "--pdos") {
      pdos = base::parse<unsigned>(text).value_or(0);
    } else {
      own_node = base::parse<std::uint8_t>(text).value_or(0);
      if (own_node < 1 || own_node > 127) throw UsageError(std::string(text) + ": node IDs are 1..127");
    }
  }
  if (typed.words.size() != 1) throw UsageError("name one network file; see cbcan-network --help");
  const std::string path(typed.words.front());
  tools::Words used;
  const auto read = [&used](const std::string& name) {
    auto content = base::read_file(name);
    if (content) used.push_back(name);
    return content;
  };
  const descriptions::PlannedNetwork network = descriptions::read_network(path, read, remarks);
  for (const descriptions::PlannedNode& node : network.all)
    for (const descriptions::PlannedPdo& pdo : node.pdos)
      if (pdo.own > pdos || pdo.at >= descriptions::kFurtherAt)
        throw UsageError(fmt::format("{}:{}: node {}: the image has {} PDOs, in R3800..R3927; see --pdos",
                                     path, pdo.line, node.id, pdos));
  const descriptions::Bytes image = descriptions::image_of(network, own_node, path);
  if (!depfile.empty()) write_depfile(depfile, used);
  return binary ? std::string(image.begin(), image.end())
                : descriptions::header_of(image, std::filesystem::path(path).filename());
}

}  // namespace

int main(int count, char** words) {
  return cbcan::tools::generate("cbcan-network", kHelp, kOptions, std::span(words, words + count), output_of);
}
