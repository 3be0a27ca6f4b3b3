// SPDX-License-Identifier: MIT
// cbcan-eds: an EDS or DCF file as the object dictionary of firmware.

#include <filesystem>

#include "base/read_file.hpp"
#include "descriptions/dictionary_header.hpp"
#include "generator.hpp"

namespace {

using namespace cbcan;
using base::UsageError;

constexpr const char* kHelp = R"(usage: cbcan-eds [--name NAME] FILE

  Prints the object dictionary of an EDS or DCF file as a C++ header, for cbcan::EdsDeviceOf. Mistakes and
  their lines are on standard error.

  --name NAME   the header's namespace (default: the file's name)
)";

std::string output_of(const tools::Words& words, tools::Words& remarks) {
  std::string name, file;
  for (std::size_t i = 0; i != words.size(); ++i) {
    if (words[i] == "--name" && i + 1 != words.size())
      name = words[++i];
    else if (words[i].starts_with("-") || !file.empty())
      throw UsageError(words[i] + ": see cbcan-eds --help");
    else
      file = words[i];
  }
  if (file.empty()) throw UsageError("name an EDS or DCF file; see cbcan-eds --help");
  if (name.empty()) name = std::filesystem::path(file).stem();
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored))
    throw UsageError(file + " is a folder; name an EDS or DCF file");
  const auto content = base::read_file(file);
  if (!content) throw UsageError("cannot read " + file + "; check the path and its permissions");
  return descriptions::dictionary_header(*content, file, name, remarks);
}

}  // namespace

int main(int count, char** words) {
  return cbcan::tools::generate("cbcan-eds", kHelp, count, words, output_of);
}
