// SPDX-License-Identifier: MIT
// cbcan-eds: an EDS or DCF file as the object dictionary of firmware.

#include <array>
#include <filesystem>

#include "base/read_file.hpp"
#include "descriptions/dictionary_image.hpp"
#include "generator.hpp"

namespace {

using namespace cbcan;
using base::UsageError;

constexpr const char* kHelp = R"(usage: cbcan-eds [--name NAME] FILE

  Prints the object dictionary of an EDS or DCF file as a C++ header, for cbcan::EdsDeviceOf. Mistakes and
  their lines are on standard error.

  --name NAME   the header's namespace (default: the file's name)
)";

constexpr std::array<std::string_view, 1> kOptions{"--name NAME"};

std::string output_of(const base::ParsedArguments& typed, tools::Words& remarks) {
  std::string name;
  for (const base::Argument& argument : typed.options)
    name = argument.text;
  if (typed.words.size() != 1) throw UsageError("name one EDS or DCF file; see cbcan-eds --help");
  const std::string file(typed.words.front());
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
  return cbcan::tools::generate("cbcan-eds", kHelp, kOptions, std::span(words, words + count), output_of);
}
