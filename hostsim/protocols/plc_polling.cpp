// SPDX-License-Identifier: MIT
#include "protocols/plc_polling.hpp"

#include <fmt/core.h>

#include <utility>

namespace cbcan::protocols {

void PlcPolling::begin_round(Time now) {
  if (now < round_at_) return;
  round_at_ = now + period_;
  for (const auto& exchange : exchanges_)
    exchange->begin();
}

std::optional<window::Request> PlcPolling::next() {
  for (std::size_t i = 0; i < exchanges_.size(); ++i) {
    asking_ = (asking_ + 1) % exchanges_.size();  // in turn: a round may begin before the last has ended
    std::optional<window::Request> request = exchanges_[asking_]->next();
    if (!request) continue;
    request_ = *request;
    return request;
  }
  return std::nullopt;
}

void PlcPolling::answered(const window::Response& response) {
  ++counters_.requests;
  if (std::exchange(lost_, false)) warn_("plc " + place_ + ": answers again");
  if (response.exception != 0) return on_exception(response.exception);
  module_.on_taken({});
  exchanges_[asking_]->responded(response.words);
}

void PlcPolling::on_exception(std::uint8_t exception) {
  ++counters_.exceptions;
  const bool reads = request_.words.empty();
  const std::uint16_t first = reads ? request_.read_address : request_.write_address;
  const std::size_t count = reads ? request_.count : request_.words.size();
  if (refused_.insert(first).second)
    warn_(
        fmt::format("plc {}: answers {} its registers {}..{} by exception {}; give it these registers, or "
                    "change plc.first",
                    place_, reads ? "reading" : "writing", first, first + count - 1, exception));
  exchanges_[asking_]->lost();
}

void PlcPolling::lost(const std::string& problem) {
  ++counters_.lost;
  for (const auto& exchange : exchanges_)
    exchange->lost();
  if (!std::exchange(lost_, true)) warn_("plc " + problem + "; it is retried");
}

}  // namespace cbcan::protocols
