// SPDX-License-Identifier: MIT
#pragma once

/// The parameters that 1010h stores and 1011h restores: every value that SDO may read and write, or that
/// is marked kKept, except entries marked kSetPoint or kProcess, and 1003h, which counts errors.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/files.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/parameter_memory.hpp"

namespace cbcan::sim {

/// One stored value, as it is on the bus.
struct StoredValue {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::vector<std::uint8_t> bytes;
  bool operator==(const StoredValue&) const = default;
};

/// What LSS has stored (CiA 305, store configuration).
struct StoredLss {
  std::uint8_t node_id = 0;    ///< 1..127, 255 = none; 0 = nothing is stored
  std::uint32_t bit_rate = 0;  ///< bit/s
  bool operator==(const StoredLss&) const = default;
};

struct StoredParameters {
  std::vector<StoredValue> values;
  StoredLss lss;
  bool operator==(const StoredParameters&) const = default;
};

/// Where the parameters of a node outlive the program, for example a file.
class ParameterStore {
 public:
  /// What was saved last, if anything.
  virtual StoredParameters load() = 0;
  /// Replaces what was saved before. False = could not, nothing has changed.
  virtual bool save(const StoredParameters& parameters) = 0;
  /// These loaded values do not fit the node's dictionary and have no effect.
  virtual void tell_left_out(const std::vector<StoredValue>& /*values*/) {}

 protected:
  ~ParameterStore() = default;
};

/// Copies the parameters of first_index..last_index; `entries` describe the layout of both blocks.
void copy_parameters(std::span<const ObjectEntry> entries, std::span<const std::uint8_t> from,
                     std::span<std::uint8_t> to, std::uint16_t first_index, std::uint16_t last_index);

/// The parameters whose value in `saved` differs from that in `factory`.
std::vector<StoredValue> changed_parameters(std::span<const ObjectEntry> entries,
                                            std::span<std::uint8_t> factory, std::span<std::uint8_t> saved);

/// Restores values. Returns those that are left out, because the dictionary no longer has them or has them
/// with another length. Computed values go to the handler, if there is one.
std::vector<StoredValue> put_parameters(std::span<const StoredValue> values, ObjectDictionary& saved,
                                        ObjectHandler* handler = nullptr);

/// What 1010h of a coprocessor's own node stores: the parameters that differ from their power-on values.
class ModuleParameters final : public ParameterMemory {
 public:
  /// Null: nothing is stored, and save() must not be called. Throws what load() throws. The store outlives
  /// this.
  explicit ModuleParameters(ParameterStore* store) : store_(store) {
    if (store != nullptr) stored_ = store->load();
  }

  AbortCode save(std::uint16_t first_index, std::uint16_t last_index) override;
  AbortCode forget(std::uint16_t first_index, std::uint16_t last_index) override;
  bool load(ObjectDictionary& objects, ObjectHandler& handler, std::uint16_t first_index,
            std::uint16_t last_index, std::uint32_t step) override;
  bool keep_address(std::uint8_t node_id, std::uint8_t bit_rate) override;
  const StoredLss& lss() const { return stored_.lss; }

 private:
  AbortCode keep(std::vector<StoredValue> changed, std::uint16_t first_index, std::uint16_t last_index);
  bool keep(StoredParameters next);

  ParameterStore* store_;
  StoredParameters stored_;
  const ObjectDictionary* objects_ = nullptr;
  std::vector<StoredValue> power_on_;  ///< of all parameters, in the dictionary's order
};

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

/// Private copies of parameter files: what 1010h and LSS store lasts as long as the plant, power cuts
/// included.
class ParameterCopies {
 public:
  explicit ParameterCopies(base::FileReader read) : read_(std::move(read)) {}

  /// Reads the file the first time; throws what the reader throws.
  ParameterStore* find(const std::string& path) {
    std::unique_ptr<Copy>& copy = copies_[path];
    if (!copy) copy = std::make_unique<Copy>(path, read_(path));
    return copy.get();
  }

 private:
  class Copy final : public ParameterText {
   public:
    Copy(const std::string& path, std::optional<std::string> text)
        : ParameterText(path, [](const std::string& /*line*/) {}), text_(std::move(text)) {}

   private:
    std::optional<std::string> read() override { return text_; }
    bool write(const std::string& text) override {
      text_ = text;
      return true;
    }

    std::optional<std::string> text_;
  };

  base::FileReader read_;
  std::map<std::string, std::unique_ptr<Copy>> copies_;
};

}  // namespace cbcan::sim
