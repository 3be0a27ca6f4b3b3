// SPDX-License-Identifier: MIT
#include "scenario/scenario_writer.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "base/files.hpp"
#include "base/text.hpp"
#include "cbcan/modbus/frame_sizes.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::scenario {

namespace {

using journal::Event;
using journal::Kind;

constexpr Time kMinute = 60 * kSecond;

/// R3705 and the following registers after a read of this value.
std::vector<std::uint16_t> size_and_words(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint16_t> words(1 + (bytes.size() + 1) / 2);
  words[0] = static_cast<std::uint16_t>(bytes.size());
  std::memcpy(words.data() + 1, bytes.data(), bytes.size());
  return words;
}

}  // namespace

std::string absolute_plant(const std::string& plant_file, const std::string& folder) {
  const bool is_whole = plant_file.empty() || plant_file == "demo" || base::is_absolute(plant_file);
  return is_whole ? plant_file : folder + (folder.ends_with('/') ? "" : "/") + plant_file;
}

// ---- Steps

std::string ScenarioWriter::opening(const std::string& plant) {
  return plant.empty() ? "" : fmt::format("plant = {}\n", base::toml_text(plant));
}

std::string ScenarioWriter::step(Time at, std::string_view keys) const {
  return fmt::format("\n[[step]]\nat = \"{}us\"\n{}\n", at - begin_, keys);
}

std::string ScenarioWriter::written(Time at, std::size_t network, std::size_t first,
                                    std::span<const std::uint16_t> words) const {
  return step(at,
              fmt::format("do = \"write {}{} {}\"", plant::prefix_of(network), first, base::joined(words)));
}

std::string ScenarioWriter::text_of(const Event& event) const {
  if (event.kind == Kind::kModbus) return request(event);
  if (event.kind == Kind::kEnded) return ended(event);
  if (event.kind != Kind::kCommand || event.state == journal::kRefused) return {};
  return step(event.at, fmt::format("do = {}", base::toml_text(control_.journal().text(event))));
}

/// FC 22 is left out, as the written value is not known.
std::string ScenarioWriter::request(const Event& event) const {
  const auto pdu =
      control_.journal().bytes(event).first(control_.journal().bytes(event).empty() ? 0 : event.index);
  if (event.state != 0 || pdu.empty()) return {};
  const RegisterRange registers{0, control_.network(event.network).registers()};
  const modbus::Range range = modbus::check(pdu, RegisterMap(std::span(&registers, 1)), nullptr).written;
  if (range.count == 0 || pdu[0] == modbus::kMaskWriteRegister) return {};
  std::vector<std::uint16_t> words;
  for (std::size_t at = pdu.size() - 2 * range.count; at < pdu.size(); at += 2)
    words.push_back(static_cast<std::uint16_t>(modbus::word(pdu, at)));
  return written(event.at, event.network, range.first, words);
}

/// Writes only a comment for a transaction that began before the scenario or has no result.
std::string ScenarioWriter::ended(const Event& event) const {
  const std::string text = fmt::format("# #{} {}: {}\n", event.transaction,
                                       request_text(event, control_.journal(), find_), result_text(event));
  const bool known = !journal::is_cancelled(event) && event.at - event.took >= begin_;
  return known ? text + expected(event) : text;
}

std::string ScenarioWriter::expected(const Event& ended) const {
  const bool scanned = ended.state != 0;
  const std::size_t in = regmap::of_channel(control_.network(ended.network).module_config().scanner_in_first,
                                            std::max<unsigned>(ended.state, 1));
  const auto is = [&](std::size_t window, std::size_t scanner, const std::vector<std::uint16_t>& words,
                      std::string_view so = "=") {
    return fmt::format("\"register {}{} {} {}\"", plant::prefix_of(ended.network),
                       scanned ? in + scanner : window, so, base::joined(words));
  };
  const auto low = [](std::uint32_t number) { return static_cast<std::uint16_t>(number); };
  std::string all = is(regmap::kExecuteFlag, regmap::kScannerResult, {ended.result});
  const bool reads = ended.service == journal::Service::kRead || ended.service == journal::Service::kState;
  if (ended.result == 0 && reads)
    all +=
        ", " + is(regmap::kDataSize, regmap::kScannerSize, size_and_words(control_.journal().bytes(ended)));
  if (ended.result == static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError))
    all += ", " + is(regmap::kData, regmap::kScannerData, {low(ended.code), low(ended.code >> 16)});
  return fmt::format("\n[[step]]\nwait = {}\nexpect = [{}]\n",
                     is(regmap::kExecuteFlag, regmap::kScannerAnswered,
                        {scanned ? low(ended.frame.id) : regmap::kExecute}, scanned ? "=" : "!="),
                     all);
}

// ---- Sessions

namespace {

/// Line for the start of an event before the last minute, if its effect lasts; else empty.
std::string lasting(const Event& event, const journal::Journal& journal) {
  if (event.kind != Kind::kCommand || event.state == journal::kRefused) return {};
  const std::string_view command = journal.text(event);
  const std::string_view name = base::words_of(command).front();
  const bool lasts = name != "write" && name != "trigger" && name != "send";
  return lasts ? fmt::format("  {},\n", base::toml_text(command)) : "";
}

/// A used scanner window continues with its numbers; a module that starts answers the first number by 5.
std::string handshake(const Event& ended, const config::ModuleConfig& module) {
  if (ended.result == static_cast<std::uint16_t>(regmap::Result::kRestarted)) return {};
  return fmt::format("  \"write {}{} {}\",\n", plant::prefix_of(ended.network),
                     regmap::of_channel(module.scanner_out_first, ended.state),
                     ended.frame.id == 1 ? 0xFFFF : ended.frame.id - 1);
}

}  // namespace

LastMinute::LastMinute(plant::Control& control, const journal::FindName& find, std::string plant)
    : control_(control),
      plant_(std::move(plant)),
      now_(control.now()),
      begin_(now_ > kMinute ? now_ - kMinute : 0),
      writer_(control, find, begin_),
      next_(control.journal().first()),
      end_(control.journal().end()) {}

bool LastMinute::append(base::Buffer& to) {
  if (next_ < end_) {
    steps_.push_back(collect());
  } else if (!std::exchange(has_begun_, true)) {
    base::append(to, "# Saved from the page: ", base::seconds_text(now_ - begin_), " s up to ",
                 base::seconds_text(now_), ".\n", ScenarioWriter::opening(plant_));
    if (!before_.empty()) base::append(to, writer_.step(begin_, fmt::format("do = [\n{}]", before_)));
  } else if (!steps_.empty()) {
    base::append(to, steps_.front());
    steps_.pop_front();
  } else {
    base::append(to, writer_.step(now_, fmt::format("expect = \"time {}us\"", now_ - begin_)));
    return false;
  }
  return true;
}

/// The steps of some events.
std::string LastMinute::collect() {
  constexpr std::uint64_t kMostEvents = 4000;
  constexpr std::size_t kMostText = 2000;
  next_ = std::max(next_, control_.journal().first());
  const std::uint64_t last = std::min(end_, next_ + kMostEvents);
  std::string steps;
  for (; next_ < last && steps.size() < kMostText; ++next_)
    steps += text_of(control_.journal()[next_]);
  return steps;
}

std::string LastMinute::text_of(const Event& event) {
  if (event.at < begin_) {
    before_ += lasting(event, control_.journal());
    return {};
  }
  if (event.kind == Kind::kEnded && event.state != 0 && scanned_.emplace(event.network, event.state).second)
    before_ += handshake(event, control_.network(event.network).module_config());
  return writer_.text_of(event);
}

}  // namespace cbcan::scenario
