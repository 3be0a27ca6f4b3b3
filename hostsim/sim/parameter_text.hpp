// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/parameters.hpp"

namespace cbcan::sim {

/// The text, and back; `path` is for the message of the UsageError.
std::string parameter_text(const StoredParameters& parameters);
StoredParameters parse_parameters(std::string_view text, const std::string& path);

/// The parameters that a node has stored through object 1010h, as a text that people can read and edit: a
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
class ParameterText : public ParameterStore {
 public:
  /// `warn` gets failures to write, for which the node has only an abort code, and values that do not fit.
  ParameterText(std::string path, std::function<void(const std::string& line)> warn)
      : path_(std::move(path)), warn_(std::move(warn)) {}

  /// A missing text counts as empty. Throws base::UsageError, with file and line, for an invalid one.
  StoredParameters load() override;
  bool save(const StoredParameters& parameters) override { return write(parameter_text(parameters)); }
  void tell_left_out(const std::vector<StoredValue>& values) override;

 protected:
  ~ParameterText() = default;

  /// nullopt = there is none yet.
  virtual std::optional<std::string> read() = 0;
  /// False = could not, which has been reported.
  virtual bool write(const std::string& text) = 0;

  std::string path_;
  std::function<void(const std::string&)> warn_;
};

}  // namespace cbcan::sim
