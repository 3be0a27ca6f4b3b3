// SPDX-License-Identifier: MIT
// cbcan-network: a network file as the objects of the module, for images of a board.

#include <fmt/core.h>

#include <cstdio>
#include <filesystem>
#include <vector>

#include "files/read_file.hpp"
#include "network/network_image.hpp"
#include "options/exit_code.hpp"
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

void print(const Arguments& arguments) {
  const std::string& path = arguments.file;
  std::vector<std::string> remarks;
  const network::Network network = network::read_network(path, files::read_file, remarks);
  for (const std::string& remark : remarks)
    fmt::print(stderr, "{}\n", remark);
  const network::Bytes image = network::image_of(network, arguments.own_node, path);
  const std::string output = arguments.binary
                                 ? std::string(image.begin(), image.end())
                                 : network::header_of(image, std::filesystem::path(path).filename());
  if (std::fwrite(output.data(), 1, output.size(), stdout) != output.size() || std::fflush(stdout) != 0)
    throw std::runtime_error("standard output: cannot be written");
}

}  // namespace

int main(int count, char** words) {
  const std::vector<std::string> given(words + 1, words + count);
  try {
    if (given == std::vector<std::string>{"--help"}) return std::fputs(kHelp, stdout) < 0;
    print(arguments_of(given));
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "cbcan-network: {}\n", error.what());
    return static_cast<int>(options::ExitCode::kUsage);
  }
}
