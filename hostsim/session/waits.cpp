// SPDX-License-Identifier: MIT
#include "session/waits.hpp"

#include <algorithm>

namespace cbcan::session {

std::string Waits::take(plant::Reply reply, const Dialogue& dialogue) {
  if (!reply.wait) return std::move(reply.text);
  if (auto response = reply.wait->poll()) return std::move(*response);
  dialogue->waiting = true;
  waiting_.push_back({std::move(reply.wait), dialogue, machine_now_()});
  return {};
}

void Waits::answer(const Waiting& waiting, const std::string& response) {
  const auto dialogue = waiting.dialogue.lock();
  dialogue->waiting = false;
  dialogue->unsent += response;
}

bool Waits::poll_waiting() {
  const std::size_t ended = std::erase_if(waiting_, [](const Waiting& waiting) {
    if (waiting.dialogue.expired()) return true;
    const auto response = waiting.wait->poll();
    if (response) answer(waiting, *response);
    return response.has_value();
  });
  return ended != 0;
}

bool Waits::want_time() const {
  return std::ranges::any_of(waiting_, [](const Waiting& waiting) { return !waiting.wait->is_up_to_plc(); });
}

bool Waits::are_passes() const {
  return std::ranges::all_of(waiting_, [](const Waiting& waiting) { return waiting.wait->is_pass; });
}

Time Waits::plc_deadline() const {
  return sim::earliest(waiting_, [](const Waiting& waiting) { return waiting.since + waiting.wait->within; });
}

void Waits::give_up_on_plc(Time now) {
  std::erase_if(waiting_, [now](const Waiting& waiting) {
    const bool is_over = waiting.wait->is_up_to_plc() && now >= waiting.since + waiting.wait->within;
    if (is_over && !waiting.dialogue.expired()) answer(waiting, waiting.wait->give_up());
    return is_over;
  });
}

}  // namespace cbcan::session
