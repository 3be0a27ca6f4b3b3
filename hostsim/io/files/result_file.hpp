// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "io/loop/output.hpp"

namespace cbcan::io {

/// A file of an option, for results that are known at the end. It is opened at the beginning, so that a wrong
/// path is reported then.
class ResultFile {
 public:
  /// Throws EnvironmentError.
  ResultFile(std::string_view option, const std::string& path)
      : name_(std::string(option) + " " + path), file_(Output::open(option, path)) {}

  /// The whole content. Throws EnvironmentError.
  void write(std::string_view text) {
    file_.add(text);
    if (const int wrong = file_.flush(); wrong != 0)
      throw EnvironmentError(name_ + ": " + reason(wrong) + "; write another file");
  }

 private:
  std::string name_;
  Output file_;
};

/// Makes the folder of an option unless it is there. Throws UsageError if it cannot be made.
inline void make_folder(std::string_view option, const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored))
    throw UsageError(std::string(option) + " " + path + ": " + error.message() + "; name another folder");
}

}  // namespace cbcan::io
