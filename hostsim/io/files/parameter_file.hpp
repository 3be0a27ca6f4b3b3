// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "io/errors.hpp"
#include "sim/parameters.hpp"

namespace cbcan::io {

/// What object 1010h of a node has stored, in a text file that people can read and edit: a line for each
/// value that is not the one of the EDS file or of power-on, such as
///
///   1017:00 = E803
///
/// with the bytes as they are on the bus, low byte first; and what LSS has stored, in decimal:
///
///   node-id = 5
///   bit-rate = 250000
///
/// Lines that begin with # mean nothing. The file is made when something is stored for the first time.
class ParameterFile final : public sim::ParameterStore {
 public:
  /// `warn` is told what cannot be written, as the node has only an abort code for it, and what does not fit.
  ParameterFile(std::string path, Warn warn) : path_(std::move(path)), warn_(std::move(warn)) {}

  /// A file that is not there is empty. Throws UsageError for one that cannot be understood, with file and
  /// line.
  sim::StoredParameters load() override;

  /// Replaces the file as a whole: a crash leaves the old one or the new one.
  bool save(const sim::StoredParameters& parameters) override;

  void tell_left_out(const std::vector<sim::StoredValue>& values) override;

 private:
  std::string path_;
  Warn warn_;
};

/// The text of such a file. Both are pure; `path` is for the message of the UsageError.
std::string parameter_text(const sim::StoredParameters& parameters);
sim::StoredParameters parse_parameters(std::string_view text, const std::string& path);

}  // namespace cbcan::io
