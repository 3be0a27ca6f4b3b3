// SPDX-License-Identifier: MIT
// cbcan-eds: an EDS or DCF file as the object dictionary of firmware.

#include <filesystem>

#include "base/read_file.hpp"
#include "descriptions/dictionary_header.hpp"
#include "generator.hpp"

namespace {

using namespace cbcan;
using base::UsageError;

constexpr const char* kHelp =
    "usage: cbcan-eds [--name NAME] FILE\n\n"
    "  Prints the object dictionary of an EDS or DCF file as a C++ header, for cbcan::EdsDeviceOf. Mistakes "
    "and\n"
    "  their lines are on standard error.\n\n"
    "  --name NAME   the header's namespace (default: the file's name)\n";

struct Arguments {
  std::string name;
  std::string file;
};

Arguments arguments_of(const tools::Words& words) {
  Arguments arguments;
  for (std::size_t i = 0; i != words.size(); ++i) {
    if (words[i] == "--name" && i + 1 != words.size())
      arguments.name = words[++i];
    else if (words[i].starts_with("-") || !arguments.file.empty())
      throw UsageError(words[i] + ": see cbcan-eds --help");
    else
      arguments.file = words[i];
  }
  if (arguments.file.empty()) throw UsageError("name an EDS or DCF file; see cbcan-eds --help");
  if (arguments.name.empty()) arguments.name = std::filesystem::path(arguments.file).stem();
  return arguments;
}

std::string output_of(const tools::Words& words, tools::Words& remarks) {
  const Arguments arguments = arguments_of(words);
  std::error_code ignored;
  if (std::filesystem::is_directory(arguments.file, ignored))
    throw UsageError(arguments.file + " is a folder; name an EDS or DCF file");
  const auto content = base::read_file(arguments.file);
  if (!content) throw UsageError("cannot read " + arguments.file + "; check the path and its permissions");
  return descriptions::dictionary_header(*content, arguments.file, arguments.name, remarks);
}

}  // namespace

int main(int count, char** words) {
  return cbcan::tools::generate("cbcan-eds", kHelp, count, words, output_of);
}
