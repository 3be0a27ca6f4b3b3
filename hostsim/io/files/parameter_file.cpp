// SPDX-License-Identifier: MIT
#include "io/files/parameter_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "cbcan/canopen/lss_slave.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "files/read_file.hpp"
#include "io/loop/descriptor.hpp"
#include "text/numbers.hpp"
#include "text/words.hpp"

namespace cbcan::io {

namespace {

constexpr std::string_view kHeading =
    "# Written by object 1010h (store parameters) and LSS.\n"
    "# index:sub-index = bytes, low byte first\n";
constexpr std::string_view kNodeId = "node-id";
constexpr std::string_view kBitRate = "bit-rate";

/// False: not a number, or it does not fit.
template <class Number>
bool read_number(std::string_view text, Number& number, int base) {
  const auto read = text::parse<Number>(text::trim(text), base);
  if (read) number = *read;
  return read.has_value();
}

bool parse_object(std::string_view object, std::string_view digits, sim::StoredValue& value) {
  const auto address = text::split(object, ':');
  if (!address || digits.size() % 2 != 0 || !read_number(address->first, value.index, 16) ||
      !read_number(address->second, value.sub, 16))
    return false;
  for (std::size_t at = 0; at < digits.size(); at += 2)
    if (!read_number(digits.substr(at, 2), value.bytes.emplace_back(), 16)) return false;
  return true;
}

bool is_node_id(std::uint8_t id) {
  return (id >= 1 && id <= nmt::kMaxNode) || id == LssSlave::kNoNodeId;
}

/// False: the line is invalid.
bool parse_line(std::string_view line, sim::StoredParameters& parameters) {
  const auto sides = text::split(line, '=');
  if (!sides) return false;
  const std::string_view key = text::trim(sides->first);
  const std::string_view value = text::trim(sides->second);
  if (key == kNodeId)
    return read_number(value, parameters.lss.node_id, 10) && is_node_id(parameters.lss.node_id);
  if (key == kBitRate) return read_number(value, parameters.lss.bit_rate, 10);
  parameters.values.emplace_back();
  return parse_object(key, value, parameters.values.back());
}

/// Makes sure that a rename is on the disk.
bool sync_folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const Descriptor opened(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return opened && ::fsync(opened.get()) == 0;
}

/// Always creates a new file, so that a link at this path does not redirect the writing.
bool write_whole(const std::string& path, const std::string& text) {
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) return false;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "wbx"), std::fclose);
  if (!file) return false;
  return std::fwrite(text.data(), 1, text.size(), file.get()) == text.size() &&
         std::fflush(file.get()) == 0 && ::fsync(::fileno(file.get())) == 0;
}

}  // namespace

std::string parameter_text(const sim::StoredParameters& parameters) {
  std::string text(kHeading);
  if (parameters.lss.node_id != 0)
    text +=
        fmt::format("{} = {}\n{} = {}\n", kNodeId, parameters.lss.node_id, kBitRate, parameters.lss.bit_rate);
  for (const sim::StoredValue& value : parameters.values)
    text += fmt::format("{:04X}:{:02X} = {}\n", value.index, value.sub, text::hex(value.bytes, ""));
  return text;
}

sim::StoredParameters parse_parameters(std::string_view text, const std::string& path) {
  sim::StoredParameters parameters;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = text::trim(text::take_line(text));
    if (line.empty() || line.front() == '#' || parse_line(line, parameters)) continue;
    throw UsageError(
        fmt::format("{}:{}: \"{}\": write INDEX:SUB = BYTES in hexadecimal, such as 1017:00 = E803, "
                    "node-id = 1..127 or bit-rate = 250000",
                    path, number, line));
  }
  return parameters;
}

sim::StoredParameters ParameterFile::load() {
  const std::optional<std::string> text = files::read_file(path_);
  if (text) return parse_parameters(*text, path_);
  if (::access(path_.c_str(), F_OK) == 0)
    throw UsageError(path_ + ": this file with stored parameters cannot be read; check its permissions");
  return {};
}

void ParameterFile::tell_left_out(const std::vector<sim::StoredValue>& values) {
  constexpr std::size_t kMostNamed = 20;
  std::string names;
  for (const sim::StoredValue& value : std::span(values).first(std::min(values.size(), kMostNamed)))
    names += fmt::format("{}{:04X}:{:02X}", names.empty() ? "" : ", ", value.index, value.sub);
  if (values.size() > kMostNamed) names += fmt::format(" and {} more", values.size() - kMostNamed);
  warn_(fmt::format("{}: left out, as the node has no such parameter of this length: {}", path_, names));
}

bool ParameterFile::save(const sim::StoredParameters& parameters) {
  const std::string fresh = path_ + ".new";
  if (write_whole(fresh, parameter_text(parameters)) && std::rename(fresh.c_str(), path_.c_str()) == 0 &&
      sync_folder_of(path_))
    return true;
  warn_(path_ + ": parameters could not be stored: " + reason(errno));
  static_cast<void>(::unlink(fresh.c_str()));
  return false;
}

}  // namespace cbcan::io
