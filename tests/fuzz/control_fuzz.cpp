// SPDX-License-Identifier: MIT
// Any lines as commands at run time: each has its response, and a rejected one has changed nothing.

#include "fuzz/device_plant.hpp"
#include "fuzz/fuzz.hpp"
#include "plant/control.hpp"

namespace cbcan::fuzz {

namespace {

constexpr Time kBetweenLines = 20 * kMillisecond;

struct Commands {
  void take(std::string_view line) {
    const std::string before = state();
    const plant::Reply reply = control_.execute(line, plant_.now);
    if (reply.wait) {
      require(reply.text.empty(), "one response is enough");
      reply.wait->poll();
    } else if (check(line, reply.text))
      require(state() == before, "what is refused has changed nothing");
    plant_.settle();
    plant_.advance_to(plant_.now + kBetweenLines);
  }

 private:
  std::string state() {
    return control_.execute("nodes", plant_.now).text + control_.execute("faults", plant_.now).text;
  }

  /// True: an error.
  static bool check(std::string_view line, std::string_view response) {
    if (response.empty()) {
      require(line.find_first_not_of(" \t\r\v\f") == std::string_view::npos, "a command is answered");
      return false;
    }
    require(response.ends_with('\n'), "a response is whole lines");
    response.remove_suffix(1);
    const bool refused = response.starts_with("error: ");
    const std::size_t last_line = response.rfind('\n');
    if (refused) require(last_line == std::string_view::npos, "an error is one line");
    const std::string_view last = response.substr(last_line + 1);
    require(refused || last == "ok" || last.starts_with("ok "), "the last line says how it went");
    return refused;
  }

  DevicePlant plant_{{}};
  test::BareNetwork empty_;
  plant::Control control_{{&plant_.network, &empty_.network}, plant_.now};
};

}  // namespace

void run(Input input) {
  std::string_view text = text_of(input.rest());
  Commands commands;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    commands.take(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
}

}  // namespace cbcan::fuzz
