// SPDX-License-Identifier: MIT
// Runs the linked fuzz target with its corpus: with `corpus/eds` every file of that folder, and every input of
// tests/fuzz/corpus/eds.packed.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "fuzz/fuzz.hpp"
#include "support/cases.hpp"

namespace {

std::string contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Prints the name first: the last name printed is the input that failed.
void give(const std::string& name, const std::string& input) {
  std::cout << name << std::endl;
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
}

std::size_t give_files(const std::filesystem::path& folder) {
  std::size_t inputs = 0;
  if (!std::filesystem::exists(folder)) return 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    give(entry.path().filename().string(), contents(entry.path()));
    ++inputs;
  }
  return inputs;
}

/// Each input is its size, ":", its bytes and "," (tests/fuzz/corpus_file).
std::size_t give_packed(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::size_t inputs = 0, size = 0;
  while (file >> size && file.get() == ':') {
    std::string input(size, '\0');
    file.read(input.data(), static_cast<std::streamsize>(size));
    if (file.get() != ',') break;
    give("packed-" + std::to_string(inputs), input);
    ++inputs;
  }
  return inputs;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0]
              << " FOLDER: gives the target every file in it, and what is packed in FOLDER.packed\n";
    return 2;
  }
  const std::string folder = argv[1];
  const std::size_t inputs = give_files(folder) + give_packed(folder + ".packed");
  return cbcan::test::any_ran(inputs) ? EXIT_SUCCESS : EXIT_FAILURE;
}
