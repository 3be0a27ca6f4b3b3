// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "eds/eds_reader.hpp"

namespace cbcan::tests {

std::string read_file(const std::filesystem::path& path);

/// The EDS and DCF files of the corpus, in the order of their names.
std::vector<std::filesystem::path> corpus_files();

/// What a `.expected` file holds: the word "diagnostics", one `line: severity: message` a line, the word
/// "objects", one line for each object: index, sub or range of subs, type, access, pdo if mapped, the value
/// in hexadecimal (- if it is empty), [low..high], "name", = "denotation".
std::string summary(const eds::Result& result);

}  // namespace cbcan::tests
