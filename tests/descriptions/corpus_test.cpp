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
  const std::string table = corpus_text("README.md");
  for (const std::string& file : corpus_files()) {
    INFO(file);
    CHECK(table.find("`" + file + "`") != std::string::npos);
  }
}

TEST_CASE("Every file of the corpus gives the diagnostics and objects expected of it") {
  for (const std::string& file : corpus_files()) {
    INFO(file);
    const descriptions::Result result = descriptions::read(corpus_text(file), file, std::nullopt);
    CHECK(summary(result) == corpus_text(file + ".expected"));
  }
}

TEST_CASE("The values of every file of the corpus can be moved from one node ID to another") {
  std::size_t moved = 0;
  for (const std::string& file : corpus_files()) {
    INFO(file);
    const auto image = [&](std::uint8_t node_id) {
      return descriptions::dictionary_image(descriptions::read(corpus_text(file), file, node_id).device);
    };
    descriptions::DictionaryImage from = image(5);
    change_node_id(from.values, from.node_id_values, 5, 6);
    CHECK(from.values == image(6).values);
    moved += from.node_id_values.size();
  }
  CHECK(moved >= 10);
}

}  // namespace cbcan::tests
