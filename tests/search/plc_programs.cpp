// SPDX-License-Identifier: MIT
// PLC programs for --explore: correct ones, and each with one bug. usage: plc_programs NAME
#include <sys/wait.h>

#include <cstdio>
#include <functional>
#include <map>
#include <optional>
#include <string_view>

#include "plc_link.hpp"

namespace cbcan::test {

namespace {

constexpr int kGaveUp = 75;
constexpr std::uint16_t kDrive = 16, kModule = 66;
constexpr std::uint16_t kFlag = 3700, kExecute = 0xCA0E, kRead = 5055, kWrite = 5066;
constexpr std::uint16_t kModeOfOperation = 0x6060, kControlword = 0x6040, kStatusword = 0x6041,
                        kTarget = 0x607A, kVelocity = 0x6081;
constexpr int kTries = 4;

struct Failed {};

class Plc {
 public:
  /// One request, one result: R3700, or nullopt if a fault has taken it. 77h is in no request: what it
  /// replaces is not taken for the result of this one.
  std::optional<std::uint16_t> request(std::uint16_t command, std::uint16_t node, std::uint16_t index,
                                       std::uint16_t sub, std::uint16_t size, std::uint32_t value) {
    const std::array<std::uint16_t, 8> words{kExecute,
                                             command,
                                             node,
                                             index,
                                             sub,
                                             size,
                                             static_cast<std::uint16_t>(value),
                                             static_cast<std::uint16_t>(value >> 16)};
    const std::array<std::uint16_t, 2> none{0, 0x77};
    if (!link.write(kFlag, none.data(), 2) || !link.write(kFlag, words.data(), command == kRead ? 6 : 8))
      return std::nullopt;
    if (!link.command("wait register 3700 != 0xCA0E within 20s")) return std::nullopt;
    if (!link.read(kFlag, window_.data(), 8) || window_[1] != command || window_[3] != index)
      return std::nullopt;
    return window_[0];
  }
  bool write(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint16_t size,
             std::uint32_t value) {
    return request(kWrite, node, index, sub, size, value) == 0;
  }
  std::optional<std::uint32_t> read(std::uint16_t node, std::uint16_t index, std::uint16_t sub,
                                    std::uint16_t size) {
    if (request(kRead, node, index, sub, size, 0) != 0 || window_[5] != size) return std::nullopt;
    const std::uint32_t value = window_[6] | std::uint32_t{window_[7]} << 16;
    return size == 2 ? value & 0xFFFF : value;
  }

  /// Until it is confirmed.
  void must_write(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint16_t size,
                  std::uint32_t value) {
    for (int i = 0; i < kTries; ++i)
      if (write(node, index, sub, size, value)) return;
    throw Failed();
  }
  std::uint32_t must_read(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint16_t size) {
    for (int i = 0; i < kTries; ++i)
      if (const auto value = read(node, index, sub, size)) return *value;
    throw Failed();
  }
  void control(std::uint16_t word) { must_write(kDrive, kControlword, 0, 2, word); }
  /// The bits of the statusword.
  void await(std::uint16_t mask, std::uint16_t value) {
    for (int i = 0; i < 200; ++i) {
      if ((must_read(kDrive, kStatusword, 0, 2) & mask) == value) return;
      link.pass("20ms");
    }
    throw Failed();
  }

  PlcLink link;

 private:
  std::array<std::uint16_t, 8> window_{};
};

// ---- A drive

/// What may be wrong with it.
struct Bugs {
  bool velocity_unchecked = false;    ///< one write of 6081h, and no look at its result
  bool second_try_unchecked = false;  ///< a second write if the first fails, and no look at its result
  bool relative = false;              ///< relative moves, repeated if their confirmation is lost
  bool gives_up = false;              ///< where a correct program begins again
  bool status_not_awaited = false;    ///< writes controlwords without waiting for the states
};

void set_velocity(Plc& plc, const Bugs& bugs) {
  constexpr std::uint32_t kPerSecond = 20000;
  const auto try_it = [&plc] { return plc.write(kDrive, kVelocity, 0, 4, kPerSecond); };
  if (bugs.velocity_unchecked)
    try_it();
  else if (bugs.second_try_unchecked)
    try_it() || try_it();
  else
    plc.must_write(kDrive, kVelocity, 0, 4, kPerSecond);
}

void enable(Plc& plc, const Bugs& bugs) {
  plc.control(0x80);
  plc.control(0);
  plc.await(0x4F, 0x40);
  plc.control(6);
  if (!bugs.status_not_awaited) plc.await(0x6F, 0x21);
  plc.control(0xF);
  if (!bugs.status_not_awaited) plc.await(0x6F, 0x27);
}

/// To 8000 in two steps.
void move(Plc& plc, const Bugs& bugs) {
  for (std::uint32_t position = 4000; position <= 8000; position += 4000) {
    plc.must_write(kDrive, kTarget, 0, 4, bugs.relative ? 4000 : position);
    const std::uint16_t new_set_point = bugs.relative ? 0x5F : 0x1F;
    bool confirmed = false;
    for (int i = 0; i < kTries && !confirmed; ++i) {
      plc.control(0xF);
      confirmed = plc.write(kDrive, kControlword, 0, 2, new_set_point);
    }
    if (!confirmed) throw Failed();
    plc.await(0x1000, 0x1000);
    plc.control(0xF);
    plc.await(0x1400, 0x400);
  }
}

void commission(Plc& plc, const Bugs& bugs) {
  plc.must_write(kDrive, kModeOfOperation, 0, 1, 1);
  set_velocity(plc, bugs);
  enable(plc, bugs);
  move(plc, bugs);
}

/// If something fails, the drive is switched off; then everything again.
int run_drive(Plc& plc, const Bugs& bugs) {
  for (int i = 0; i < (bugs.gives_up ? 1 : 5); ++i) {
    try {
      commission(plc, bugs);
      return 0;
    } catch (const Failed&) {
      for (int k = 0; k < kTries && !plc.write(kDrive, kControlword, 0, 2, 0); ++k)
        plc.link.pass("100ms");
    }
  }
  return kGaveUp;
}

// ---- A tank

/// To 500 mm. `keeps_level`: after a failed read, the level before it is taken.
int fill(Plc& plc, bool keeps_level) {
  std::uint32_t level = 0;
  int missed = 0;
  const auto set_valve = [&plc](bool open) { return plc.write(kModule, 0x6200, 1, 1, open ? 1 : 0); };
  const auto close = [&set_valve] {
    for (int i = 0; i < 3 * kTries; ++i)
      if (set_valve(false)) return true;
    return false;
  };
  for (bool is_open = false; level < 500 * 16;) {
    const auto now = plc.read(kModule, 0x6401, 1, 2);
    level = now.value_or(level);
    if (level < 500 * 16 && !is_open) is_open = set_valve(true);
    const bool good = (now || keeps_level) && (is_open || level >= 500 * 16);
    missed = good ? 0 : missed + 1;
    if (!good && (!close() || missed == kTries)) return kGaveUp;
    is_open = is_open && good;
    plc.link.pass("200ms");
  }
  return close() ? 0 : kGaveUp;
}

/// The same as a cyclic program, which never ends: a request at a time through the scanner window. After a
/// failure the inlet is closed. `any_is_done`: no look at the result.
int fill_in_scans(Plc& plc, bool any_is_done) {
  std::array<std::uint16_t, 8> out{};
  std::array<std::uint16_t, 6> in{};
  bool reads = true;
  while (true) {
    if (in[0] == out[0]) {
      const bool good = in[1] == 0 || any_is_done;
      const bool opens = good && (reads ? out[0] != 0 && in[4] < 500 * 16 : out[6] != 0);
      reads = good && !reads;
      const std::uint16_t number = out[0] == 65535 ? 1 : out[0] + 1;
      out = reads ? std::array<std::uint16_t, 8>{number, kRead, kModule, 0x6401, 1, 2}
                  : std::array<std::uint16_t, 8>{number, kWrite, kModule, 0x6200, 1, 1, opens};
    }
    plc.link.scan(500, out, 600, in);
  }
}

// ---- Parameters

/// Expects 1017h = 1000 to be stored, and stores 500 instead.
int store_parameters(Plc& plc) {
  constexpr std::uint16_t kHeartbeat = 0x1017, kStore = 0x1010;
  constexpr std::uint32_t kSave = 0x65766173;
  if (plc.must_read(kModule, kHeartbeat, 0, 2) != 1000) return 3;
  plc.must_write(kModule, kHeartbeat, 0, 2, 500);
  plc.must_write(kModule, kStore, 1, 4, kSave);
  plc.link.command("power 66 off");
  plc.link.command("power 66 on");
  plc.link.pass("100ms");
  return plc.must_read(kModule, kHeartbeat, 0, 2) == 500 ? 0 : 4;
}

// ---- What cannot be explored, or does not end

int poll_without_time(Plc& plc) {
  for (std::uint16_t word = 0;;)
    plc.link.read(kFlag, &word, 1);
}

/// Leaves a process that has the connection.
int leave_a_process(Plc& plc) {
  if (::fork() != 0) return plc.must_write(kDrive, kVelocity, 0, 4, 1), 0;
  ::setsid();
  ::pause();
  return 0;
}

int write_the_time_of_day(Plc& plc) {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return plc.must_write(kDrive, kVelocity, 0, 4, static_cast<std::uint32_t>(now.tv_nsec)), 0;
}

const std::map<std::string_view, std::function<int(Plc&)>> kPrograms{
    {"drive", [](Plc& plc) { return run_drive(plc, {}); }},
    {"ignored-abort", [](Plc& plc) { return run_drive(plc, {.velocity_unchecked = true}); }},
    {"second-try", [](Plc& plc) { return run_drive(plc, {.second_try_unchecked = true}); }},
    {"relative", [](Plc& plc) { return run_drive(plc, {.relative = true}); }},
    {"gives-up", [](Plc& plc) { return run_drive(plc, {.gives_up = true}); }},
    {"no-wait", [](Plc& plc) { return run_drive(plc, {.gives_up = true, .status_not_awaited = true}); }},
    {"fill", [](Plc& plc) { return fill(plc, false); }},
    {"kept-level", [](Plc& plc) { return fill(plc, true); }},
    {"scans", [](Plc& plc) { return fill_in_scans(plc, false); }},
    {"scans-blindly", [](Plc& plc) { return fill_in_scans(plc, true); }},
    {"stores", store_parameters},
    {"polls", poll_without_time},
    {"leaves-a-process", leave_a_process},
    {"time-of-day", write_the_time_of_day},
    {"fails", [](Plc&) { return 3; }},
};

}  // namespace

}  // namespace cbcan::test

int main(int argc, char** argv) {
  using namespace cbcan::test;
  const auto found = kPrograms.find(argc == 2 ? argv[1] : "");
  if (found == kPrograms.end()) return std::puts("usage: plc_programs NAME"), 2;
  Plc plc;
  return found->second(plc);
}
