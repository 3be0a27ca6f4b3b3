// SPDX-License-Identifier: MIT
// Each file of the corpus has one quirk, which its name says, and the expected result beside it.
#include "corpus.hpp"
#include "descriptions/dictionary_image.hpp"
#include "support/catch.hpp"

namespace cbcan::tests {

TEST_CASE("The corpus is there") {
  CHECK(corpus_files().size() >= 56);
}

TEST_CASE("The corpus's README names every file") {
  const std::string table = read_file(EDS_CORPUS "/README.md");
  for (const std::filesystem::path& path : corpus_files()) {
    INFO(path.filename().string());
    CHECK(table.find("`" + path.filename().string() + "`") != std::string::npos);
  }
}

TEST_CASE("Every file of the corpus gives the diagnostics and objects expected of it") {
  for (const std::filesystem::path& path : corpus_files()) {
    INFO(path.filename().string());
    const descriptions::Result result = descriptions::read(read_file(path), path.filename().string(), std::nullopt);
    CHECK(summary(result) == read_file(path.string() + ".expected"));
  }
}

TEST_CASE("The values of every file of the corpus can be moved from one node ID to another") {
  std::size_t moved = 0;
  for (const std::filesystem::path& path : corpus_files()) {
    INFO(path.filename().string());
    const auto image = [&](std::uint8_t node_id) {
      return descriptions::dictionary_image(descriptions::read(read_file(path), path.filename().string(), node_id).device);
    };
    descriptions::DictionaryImage from = image(5);
    change_node_id(from.values, from.node_id_values, 5, 6);
    CHECK(from.values == image(6).values);
    moved += from.node_id_values.size();
  }
  CHECK(moved >= 10);
}

}  // namespace cbcan::tests
