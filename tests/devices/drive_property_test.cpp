// SPDX-License-Identifier: MIT
// Properties of a drive that hold for any sequence of actions. The seed is fixed in CMakeLists.txt.
#include <rapidcheck.h>

#include "drive_bench.hpp"

namespace cbcan::test {

namespace {

/// An action, and which of its values to use.
using Action = std::pair<unsigned, unsigned>;

template <class Value, std::size_t kCount>
Value pick(const std::array<Value, kCount>& values, unsigned which) {
  return values[which % kCount];
}

constexpr std::array<std::uint16_t, 21> kWords = {0x0000, 0x0002, 0x0006, 0x0007, 0x000F, 0x000F, 0x001F,
                                                  0x003F, 0x005F, 0x006F, 0x007F, 0x020F, 0x021F, 0x010F,
                                                  0x011F, 0x0080, 0x008F, 0x0006, 0x000F, 0x001F, 0xFFFF};
constexpr std::array<int, 12> kPositions = {0,      1,       -1,     500,    -500,   4'000,
                                            12'345, -20'000, 29'999, 40'000, 30'000, -60'000};
constexpr std::array<int, 8> kVelocities = {0, 1, -1, 5'000, -20'000, 100'000, -100'000, 300'000};
constexpr std::array<int, 8> kTurns = {0, 1, -1, 100, -150, 600, -600, 32'767};  ///< 1/min
constexpr std::array<int, 8> kProbes = {0, 0x15, 0x37, 0x0031, 0x3333, 0x3100, 0x1735, 0x3F3F};
constexpr std::array<std::uint16_t, 7> kShown = {0x6043, 0x6044, 0x60B9, 0x60BA, 0x60BB, 0x60BC, 0x60BD};
constexpr std::array<Time, 8> kTimes = {1, 100, 1'000, 7'777, 25'000, 100'000, 400'000, 3'000'000};
constexpr std::array<int, 10> kMethods = {1, 2, 17, 20, 23, 30, 33, 34, 35, 31};
constexpr std::array<nmt::State, 3> kNmtStates = {nmt::State::kPreOperational, nmt::State::kOperational,
                                                  nmt::State::kStopped};

constexpr double kFastest = 100'000;

struct Room {
  std::vector<int> modes;
  bool limits;
  bool blocking;
};

/// Limits the velocity (607Fh) for all modes.
void prepare(DriveBench& bench, const Room& room) {
  bench.put(0x607F, 0, 100'000);
  if (!room.limits) return;
  bench.put(0x607D, 1, -30'000);
  bench.put(0x607D, 2, 30'000);
}

void set_option(DriveBench& bench, unsigned which) {
  switch (which % 6) {
    case 0: return void(bench.set(0x605A, 0, which / 6 % 9));
    case 1: return void(bench.set(0x605B, 0, which / 6 % 2));
    case 2: return void(bench.set(0x605C, 0, which / 6 % 2));
    case 3: return void(bench.set(0x605D, 0, 1 + which / 6 % 4));
    case 4: return void(bench.set(0x605E, 0, which / 6 % 5));
    default: return void(bench.set(0x6007, 0, which / 6 % 4));
  }
}

void toggle(DriveBench& bench, std::set<std::string_view>& present, const Room& room, unsigned which) {
  const std::string_view name = pick(devices::kDriveIncidents, which).name;
  if (!room.blocking && name == "motor-blocked") return;
  const bool begins = present.insert(name).second;
  if (!begins) present.erase(name);
  bench.incident(name, begins);
}

/// Any action except the passing of time.
void act(DriveBench& bench, std::set<std::string_view>& present, const Room& room, const Action& action) {
  const unsigned which = action.second;
  switch (action.first) {
    case 0: return toggle(bench, present, room, which);
    case 1: return void(bench.set(0x6060, 0, room.modes[which % room.modes.size()]));
    case 2: return void(bench.set(0x607A, 0, pick(kPositions, which)));
    case 3: return void(bench.set(0x60FF, 0, pick(kVelocities, which)));
    case 4: return void(bench.set(0x6098, 0, pick(kMethods, which)));
    case 5: return set_option(bench, which);
    case 6: return void(bench.sync());
    case 7: bench.drive.on_state(pick(kNmtStates, which), bench.now); return void(bench.update());
    case 8:
      bench.drive.on_network_failure(sim::NetworkFailure::kHeartbeat, bench.now);
      return void(bench.update());
    case 9: return void(bench.set(0x6042, 0, pick(kTurns, which)));
    case 10: return void(bench.set(0x60C1, 1, pick(kPositions, which)));
    case 11: return void(bench.set(0x60C4, 2, which % 4));
    case 12: return void(bench.set(0x60B8, 0, pick(kProbes, which)));
    case 13: bench.input(which % 2 == 0 ? 0x60BA : 0x60BC, which / 2 % 2); return void(bench.update());
    case 14: return void(bench.set(0x60F2, 0, which % 4 + which / 4 % 4 * 0x40));
    case 15: bench.enable(static_cast<std::int8_t>(bench.get(0x6060))); return;
    default: return void(bench.control(pick(kWords, which)));
  }
}

constexpr unsigned kTimePasses = 22;

std::vector<Action> actions() {
  return *rc::gen::container<std::vector<Action>>(
      rc::gen::pair(rc::gen::inRange(0U, 32U), rc::gen::inRange(0U, 1000U)));
}

/// Statusword bits 0..3, 5 and 6, and their possible values after the next update.
struct StateRow {
  unsigned bits;
  std::vector<unsigned> next;
};

const std::array<StateRow, 7> kStates = {{
    {0x40, {0x40, 0x21, 0x08}},
    {0x21, {0x21, 0x23, 0x27, 0x40, 0x08}},
    {0x23, {0x23, 0x27, 0x21, 0x40, 0x08}},
    {0x27, {0x27, 0x23, 0x21, 0x40, 0x07, 0x0F, 0x08}},
    {0x07, {0x07, 0x40, 0x27, 0x0F, 0x08}},
    {0x0F, {0x0F, 0x08}},
    {0x08, {0x08, 0x40}},
}};

const StateRow* row_of(unsigned status) {
  const auto* row = std::ranges::find(kStates, status & 0x6FU, &StateRow::bits);
  return row == kStates.end() ? nullptr : row;
}

void check_step(unsigned before, unsigned after) {
  const StateRow* from = row_of(before);
  RC_ASSERT(from != nullptr);
  RC_ASSERT(row_of(after) != nullptr);
  RC_ASSERT(std::ranges::count(from->next, after & 0x6FU) == 1);
  RC_ASSERT((after & 0xC100U) == 0U);  // unused bits
  RC_ASSERT((after & 0x0200U) != 0U);
  const bool mode_bits = (after & 0x1800U) != 0;
  RC_ASSERT(!mode_bits || (after & 0x6FU) == 0x27U);
  const bool faulty = (after & 0x6FU) == 0x0FU || (after & 0x6FU) == 0x08U;
  RC_ASSERT((after & 0x2000U) == 0U || faulty || (after & 0x6FU) == 0x27U);
}

bool is_cyclic(std::int64_t mode) {
  return mode >= 7;
}

/// Checks a bench after every update against the update before.
struct Watch {
  Watch(DriveBench& bench, const Room& room) : bench_(bench), room_(room) {
    remember();
    bench.seen = [this] { look(); };
  }
  ~Watch() { bench_.seen = nullptr; }

 private:
  void look() {
    check_step(status_, bench_.status());
    const devices::Motion motion = bench_.drive.axis().demand(bench_.now);
    RC_ASSERT(std::abs(motion.velocity) <= kFastest + 1e-6);
    const bool cyclic = is_cyclic(mode_) || is_cyclic(bench_.get(0x6061));
    if (!room_.blocking && !cyclic) {
      const double seconds = static_cast<double>(bench_.now - time_) * 1e-6 + 1e-9;
      RC_ASSERT(std::abs(motion.velocity - motion_.velocity) <= 4'000'000 * seconds + 1e-6);
    }
    if (room_.limits) RC_ASSERT(std::abs(motion.position) <= 30'000 + 1e-3);
    remember();
  }

  void remember() {
    status_ = bench_.status();
    motion_ = bench_.drive.axis().demand(bench_.now);
    mode_ = bench_.get(0x6061);
    time_ = bench_.now;
  }

  DriveBench& bench_;
  const Room& room_;
  unsigned status_ = 0;
  devices::Motion motion_{};
  std::int64_t mode_ = 0;
  Time time_ = 0;
};

void run(const Room& room) {
  DriveBench bench;
  prepare(bench, room);
  std::set<std::string_view> present;
  Watch watch(bench, room);
  for (const Action& action : actions()) {
    if (action.first < kTimePasses) {
      act(bench, present, room, action);
    } else {
      for (int part = 0; part < 5; ++part)
        bench.pass(pick(kTimes, action.second) / 5 + 1);
    }
  }
}

}  // namespace

TEST_CASE("No sequence leads to a statusword outside the table, or to more than the greatest velocity") {
  const Room room{{0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 5}, false, true};
  CHECK(rc::check([&] { run(room); }));
}

TEST_CASE("No sequence is steeper than the accelerations, or leaves the software position limits") {
  const Room room{{0, 1, 2, 3, 4, 7, 9}, true, false};
  CHECK(rc::check([&] { run(room); }));
}

TEST_CASE("It does not matter how often it is read, nor which axis of a node it is") {
  const bool limits = GENERATE(false, true);
  const Room room{{0, 1, 2, 3, 4, 6, 7, 8, 9, 10}, limits, true};
  CHECK(rc::check([&] {
    DriveBench seldom;
    DriveBench often(0x2800, {});
    prepare(seldom, room);
    prepare(often, room);
    std::set<std::string_view> present_seldom;
    std::set<std::string_view> present_often;
    for (const Action& action : actions()) {
      if (action.first < kTimePasses) {
        act(seldom, present_seldom, room, action);
        act(often, present_often, room, action);
      } else {
        const Time time = pick(kTimes, action.second);
        seldom.pass(time);
        for (Time part = 0; part < 7; ++part)
          often.pass(time * (part + 1) / 7 - time * part / 7);
      }
      RC_ASSERT(often.status() == seldom.status());
      RC_ASSERT(often.position() == seldom.position());
      RC_ASSERT(often.velocity() == seldom.velocity());
      RC_ASSERT(often.log == seldom.log);
      RC_ASSERT(often.events == seldom.events);
      for (const std::uint16_t index : kShown)
        RC_ASSERT(often.get(index) == seldom.get(index));
      RC_ASSERT(often.deadline == seldom.deadline);
    }
  }));
}

}  // namespace cbcan::test
