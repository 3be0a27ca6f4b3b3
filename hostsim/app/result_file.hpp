// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "io/loop/output.hpp"

namespace cbcan::app {

/// A file of an option, for results that are known at the end. It is opened at the beginning, so that a wrong
/// path is reported then.
class ResultFile {
 public:
  /// Throws io::EnvironmentError.
  ResultFile(std::string_view option, const std::string& path)
      : name_(std::string(option) + " " + path), file_(io::Output::open(option, path)) {}

  /// The whole content. Throws io::EnvironmentError.
  void write(std::string_view text) {
    file_.add(text);
    if (const int wrong = file_.flush(); wrong != 0)
      throw io::EnvironmentError(name_ + ": " + io::reason(wrong) + "; write another file");
  }

 private:
  std::string name_;
  io::Output file_;
};

/// Throws io::UsageError if the path of an option is no folder.
inline void need_folder(std::string_view option, const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error))
    throw io::UsageError(std::string(option) + " " + path + ": there is no such folder; make it first");
}

}  // namespace cbcan::app
