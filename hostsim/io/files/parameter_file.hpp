// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "io/errors.hpp"
#include "sim/parameters.hpp"

namespace cbcan::io {

/// The parameters that a node has stored through object 1010h, in a text file that people can read and edit: a
/// line for each value that differs from the EDS file's or the power-on value, such as
///
///   1017:00 = E803
///
/// with the bytes as on the bus, low byte first; and the LSS settings, in decimal:
///
///   node-id = 5
///   bit-rate = 250000
///
/// Lines that begin with # are comments. The file is created when something is stored for the first time.
class ParameterFile final : public sim::ParameterStore {
 public:
  /// `warn` gets failures to write, for which the node has only an abort code, and values that do not fit.
  ParameterFile(std::string path, Warn warn) : path_(std::move(path)), warn_(std::move(warn)) {}

  /// A missing file counts as empty. Throws UsageError, with file and line, for an invalid one.
  sim::StoredParameters load() override;

  /// Replaces the file atomically: a crash leaves the old one or the new one.
  bool save(const sim::StoredParameters& parameters) override;

  void tell_left_out(const std::vector<sim::StoredValue>& values) override;

 private:
  std::string path_;
  Warn warn_;
};

/// The text of such a file, and back. Both are pure; `path` is for the message of the UsageError.
std::string parameter_text(const sim::StoredParameters& parameters);
sim::StoredParameters parse_parameters(std::string_view text, const std::string& path);

}  // namespace cbcan::io
