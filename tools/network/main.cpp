// SPDX-License-Identifier: MIT
// cbcan-network: a network file as the objects of the module, for images of a board.

#include <filesystem>

#include "files/read_file.hpp"
#include "generator.hpp"
#include "network/network_image.hpp"
#include "text/numbers.hpp"

namespace {

using namespace cbcan;
using text::UsageError;

constexpr const char* kHelp =
    "usage: cbcan-network [--binary] [--own-node N] NETWORK\n\n"
    "  Prints the network as a C++ header that defines kNetwork, for Coprocessor::use_network(). Mistakes "
    "and "
    "their\n"
    "  lines are on standard error.\n\n"
    "  --binary      prints the bytes alone, for a part of the flash\n"
    "  --own-node N  the module's own node ID (default: 127)\n";

struct Arguments {
  bool binary = false;
  std::uint8_t own_node = 127;
  std::string file;
};

Arguments arguments_of(const std::vector<std::string>& words) {
  Arguments arguments;
  for (std::size_t i = 0; i != words.size(); ++i) {
    if (words[i] == "--binary") {
      arguments.binary = true;
    } else if (words[i] == "--own-node" && i + 1 != words.size()) {
      const auto id = text::parse<std::uint8_t>(words[++i]);
      if (!id || *id < 1 || *id > 127) throw UsageError(words[i] + ": node IDs are 1..127");
      arguments.own_node = *id;
    } else if (words[i].starts_with("-") || !arguments.file.empty()) {
      throw UsageError(words[i] + ": see cbcan-network --help");
    } else {
      arguments.file = words[i];
    }
  }
  if (arguments.file.empty()) throw UsageError("name a network file; see cbcan-network --help");
  return arguments;
}

std::string output_of(const tools::Words& words, tools::Words& remarks) {
  const Arguments arguments = arguments_of(words);
  const std::string& path = arguments.file;
  const network::Network network = network::read_network(path, files::read_file, remarks);
  const network::Bytes image = network::image_of(network, arguments.own_node, path);
  return arguments.binary ? std::string(image.begin(), image.end())
                          : network::header_of(image, std::filesystem::path(path).filename());
}

}  // namespace

int main(int count, char** words) {
  return cbcan::tools::generate("cbcan-network", kHelp, count, words, output_of);
}
