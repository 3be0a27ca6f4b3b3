// SPDX-License-Identifier: MIT
#include "devices/lua/lua_device.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "devices/lua/script.hpp"
#include "sim/number.hpp"
#include "sim/wire.hpp"

namespace cbcan::devices {

namespace {

constexpr std::size_t kMostIncidents = 32;
/// Printed by a script in one call.
constexpr int kMostLines = 10;
/// Limit of updates in one millisecond, at the times returned by the script's update().
constexpr int kMostUpdates = 500;

constexpr const char* kBlockType = "block";
// Memory that a block has outside Lua.
constexpr std::size_t kBytesOfBlock = 600;
constexpr std::size_t kBytesOfChange = sizeof(std::pair<Time, double>);

class LuaDevice final : public LuaBehaviour {
 public:
  LuaDevice(sim::DeviceNode& node, std::uint64_t seed, std::string name, std::string text)
      : node_(node), seed_(seed), name_(std::move(name)), text_(std::move(text)) {
    begin();
  }

  void reset(bool application, Time now) override {
    if (!application) return;
    if (began_at_ == kNever) began_at_ = now;
    now_ = now;
    due_ = kNever;
    node_.error_over(kScriptFailed, now);
    quiet_ = true;
    try {
      if (std::exchange(failed_, false)) {
        begin();
        for (const auto& [place, value] : given_)
          call("set_input", now, lua_Integer{place.first}, lua_Integer{place.second}, value);
      }
      put_kept_inputs();
      call("reset", now);
      put_kept_inputs();
      for (const std::string& incident : present_)
        call("on_incident", now, std::string_view(incident), true);
    } catch (const ScriptError& error) {
      fail(error, now);
    }
    quiet_ = false;
  }

  /// Objects that the script changes are reported afterwards, since a TPDO needs all values of this time, not
  /// another call.
  Time update(Time now) override {
    if (reporting_) return report(now), due_;
    count_updates(now);
    updating_ = true;
    const Script::Result result = call("update", now);
    updating_ = false;
    if (const auto* next = std::get_if<double>(&result))
      due_ = std::max(now + 1, time_of(*next));
    else
      due_ = kNever;
    reporting_ = true;
    report(now);
    reporting_ = false;
    return failed_ ? kNever : due_;
  }

  AbortCode check(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                  Time now) override {
    const std::size_t bytes = size_of(entry.type);
    if (entry.index < object::kFirstManufacturer || bytes == 0 || bytes != value.size())
      return AbortCode::kNone;
    const double number = sim::from_raw(load_little_endian(value), entry.type, bytes);
    const Script::Result result = call("on_write", now, lua_Integer{entry.index}, lua_Integer{sub}, number);
    const auto* code = std::get_if<double>(&result);
    const auto* flag = std::get_if<bool>(&result);
    if (code == nullptr && (flag == nullptr || !*flag)) return AbortCode::kNone;
    if (code != nullptr && *code >= 0 && *code <= std::numeric_limits<std::uint32_t>::max() &&
        *code == std::floor(*code))
      return static_cast<AbortCode>(static_cast<std::uint32_t>(*code));
    fail(ScriptError(name_ + ": on_write has returned what is no SDO abort code", 0), now);
    return AbortCode::kNone;
  }

  void before_update(Time now) override { call("before_update", now); }
  void on_sync(Time now) override { call("on_sync", now); }
  void on_state(nmt::State state, Time now) override {
    if (state == nmt::State::kStopped) call("on_state", now, std::string_view("stopped"));
    if (state == nmt::State::kOperational) call("on_state", now, std::string_view("operational"));
    if (state == nmt::State::kPreOperational) call("on_state", now, std::string_view("pre-operational"));
  }
  void on_network_failure(sim::NetworkFailure /*failure*/, Time now) override {
    call("on_network_failure", now);
  }

  /// Within the declared range. Without set_input() in the script it is the object's value.
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) override {
    const auto point = std::ranges::find_if(points_, [&](const sim::Point& each) {
      return each.kind == sim::Point::Kind::kInput && each.index == index && each.sub == sub;
    });
    if (point != points_.end()) {
      if (point->low) value = std::max(value, *point->low);
      if (point->high) value = std::min(value, *point->high);
    }
    const Script::Result result = call("set_input", now, lua_Integer{index}, lua_Integer{sub}, value);
    if (result == Script::Result(true)) return given_[{index, sub}] = value, true;
    const auto entry = sim::find_number(node_.dictionary(), index, sub);
    if (point == points_.end() || !entry) return false;
    kept_[{index, sub}] = value;
    store(*entry, sub, sim::to_raw(value, entry->type, entry->capacity));
    return true;
  }

  bool is_kept(std::uint16_t index) override {
    return call("is_kept", began_at_, lua_Integer{index}) == Script::Result(true);
  }

  /// Level of an input: its object may show something else.
  std::optional<double> output(std::uint16_t index, std::uint8_t sub) const override {
    const auto given = given_.find({index, sub});
    return given == given_.end() ? std::nullopt : std::optional(given->second);
  }

  std::vector<std::string_view> incidents() const override { return {incidents_.begin(), incidents_.end()}; }
  std::vector<std::string_view> alarms() const override { return {alarms_.begin(), alarms_.end()}; }
  std::vector<sim::Point> points() const override { return points_; }
  void set_incident(std::size_t place, bool present, Time now) override {
    const std::string& incident = incidents_[place];
    if (present)
      present_.insert(incident);
    else
      present_.erase(incident);
    call("on_incident", now, std::string_view(incident), present);
  }

 private:
  // Functions for scripts: no destructor may be pending where Lua reports an error.

  static LuaDevice& of(lua_State* state) { return *static_cast<LuaDevice*>(Script::owner_of(state)); }

  /// The argument at this place; it must be in range.
  template <class Number>
  static Number whole(lua_State* state, int place) {
    constexpr lua_Integer kMost = std::numeric_limits<Number>::max();
    const lua_Integer number = luaL_checkinteger(state, place);
    luaL_argcheck(state, number >= 0 && number <= kMost, place, "is out of range");
    return static_cast<Number>(number);
  }

  /// The entry and the sub-index given by the first two arguments.
  std::pair<ObjectEntry, std::uint8_t> entry_at(lua_State* state) {
    const auto index = whole<std::uint16_t>(state, 1);
    const auto sub = lua_isnoneornil(state, 2) ? std::uint8_t{0} : whole<std::uint8_t>(state, 2);
    if (const auto entry = sim::find_number(node_.dictionary(), index, sub)) return {*entry, sub};
    std::array<char, 40> text{};
    std::snprintf(text.data(), text.size(), "the node has no number at %04Xh:%02X", unsigned{index},
                  unsigned{sub});
    luaL_error(state, "%s", text.data());
    return {};
  }

  /// has(index [, sub]): whether get() and set() can be called with it.
  static int has(lua_State* state) {
    const auto sub = lua_isnoneornil(state, 2) ? std::uint8_t{0} : whole<std::uint8_t>(state, 2);
    lua_pushboolean(
        state, sim::find_number(of(state).node_.dictionary(), whole<std::uint16_t>(state, 1), sub) ? 1 : 0);
    return 1;
  }

  /// get(index [, sub]): an integer; a float for a REAL and for a value beyond Lua's integers.
  static int get(lua_State* state) {
    const auto [entry, sub] = of(state).entry_at(state);
    const std::uint64_t raw = of(state).node_.dictionary().number(entry, sub);
    const lua_Integer integer =
        is_signed(entry.type) ? sign_extend(raw, entry.capacity) : static_cast<lua_Integer>(raw);
    const bool is_real = entry.type == DataType::kReal32 || entry.type == DataType::kReal64;
    const bool is_integer = !is_real && (integer >= 0 || is_signed(entry.type));
    if (is_integer)
      lua_pushinteger(state, integer);
    else
      lua_pushnumber(state, sim::from_raw(raw, entry.type, entry.capacity));
    return 1;
  }

  /// set(index, sub, value): rounded and limited. A changed value is an event.
  static int set(lua_State* state) {
    LuaDevice& self = of(state);
    const auto [entry, sub] = self.entry_at(state);
    if (lua_isinteger(state, 3)) {
      self.store(entry, sub, sim::whole_to_raw(lua_tointeger(state, 3), entry.type, entry.capacity));
    } else {
      const double value = lua_isboolean(state, 3) ? lua_toboolean(state, 3) : luaL_checknumber(state, 3);
      self.store(entry, sub, sim::to_raw(value, entry.type, entry.capacity));
    }
    return 0;
  }

  /// event(index [, sub]): an event for TPDOs, whether or not the value has changed.
  static int event(lua_State* state) {
    const auto [entry, sub] = of(state).entry_at(state);
    of(state).node_.changed(entry.index, sub, of(state).now_);
    return 0;
  }

  /// emcy(code [, register bits]); emcy_over(code) ends the error.
  static int error(lua_State* state) {
    const auto code = whole<std::uint16_t>(state, 1);
    const auto bits = lua_isnoneornil(state, 2) ? ErrorRegister::kGeneric : whole<std::uint8_t>(state, 2);
    of(state).node_.error(code, bits, {}, of(state).now_);
    return 0;
  }

  static int error_over(lua_State* state) {
    of(state).node_.error_over(whole<std::uint16_t>(state, 1), of(state).now_);
    return 0;
  }

  /// fault("response-late delay_ms=50"): on this node.
  static int fault(lua_State* state) {
    std::size_t length = 0;
    const char* text = luaL_checklstring(state, 1, &length);
    std::array<char, 200> problem{};
    {
      const std::string found = of(state).node_.inject({text, length}, of(state).now_);
      std::snprintf(problem.data(), problem.size(), "%s", found.c_str());
    }
    return problem[0] == '\0' ? 0 : luaL_error(state, "fault: %s", problem.data());
  }

  /// print(...): a message of the node.
  static int say(lua_State* state) {
    const int count = lua_gettop(state);
    lua_pushliteral(state, "");
    for (int i = 1; i <= count; ++i) {
      lua_pushstring(state, i == 1 ? "" : " ");
      lua_getglobal(state, "tostring");
      lua_pushvalue(state, i);
      lua_call(state, 1, 1);
      lua_concat(state, 3);
    }
    std::size_t length = 0;
    const char* text = luaL_checklstring(state, -1, &length);
    constexpr std::size_t kMostLetters = 200;
    if (++of(state).lines_ <= kMostLines)
      of(state).node_.tell({text, std::min(length, kMostLetters)}, of(state).now_);
    return 0;
  }

  /// block("pt1 time=5"): a function of the input from now on, which returns the output, and the time until
  /// which that changes; nil = it does not.
  static int block(lua_State* state) {
    std::size_t length = 0;
    const char* text = luaL_checklstring(state, 1, &length);
    std::array<char, 200> problem{};
    if (luaL_newmetatable(state, kBlockType) != 0) {
      lua_pushcfunction(state, [](lua_State* self) {
        auto* const dropped = static_cast<sim::Block*>(lua_touserdata(self, 1));
        Script::release(self, kBytesOfBlock + dropped->waiting() * kBytesOfChange);
        std::destroy_at(dropped);
        return 0;
      });
      lua_setfield(state, -2, "__gc");
    }
    Script::charge(state, kBytesOfBlock);
    void* const memory = lua_newuserdatauv(state, sizeof(sim::Block), 0);
    {
      sim::Block::Parsed parsed = sim::Block::parse({text, length});
      std::snprintf(problem.data(), problem.size(), "%s", parsed.problem.c_str());
      new (memory) sim::Block(std::move(parsed.block));
    }
    lua_insert(state, -2);
    lua_setmetatable(state, -2);
    if (problem[0] != '\0') return luaL_error(state, "%s", problem.data());
    lua_pushcclosure(state, run_block, 1);
    return 1;
  }

  static int run_block(lua_State* state) {
    constexpr std::size_t kMostWaiting = 1000;
    sim::Block& block = *static_cast<sim::Block*>(lua_touserdata(state, lua_upvalueindex(1)));
    const Time now = of(state).now_;
    const double input = luaL_checknumber(state, 1);
    if (block.waiting() >= kMostWaiting)
      return luaL_error(state, "more than 1000 changes wait in a dead-time");
    const std::size_t before = block.waiting();
    Script::charge(state, kBytesOfChange);
    block.put(input, now);
    lua_pushnumber(state, block.at(now));
    Script::release(state, (before + 1 - block.waiting()) * kBytesOfChange);
    const bool moves = block.moves_until() > now;
    if (!moves && block.next_step() == kNever) return 1;
    const Time until = earlier(block.next_step(), moves ? block.moves_until() : kNever);
    lua_pushnumber(state, until == kNever ? HUGE_VAL : of(state).seconds(until));
    return 2;
  }

 public:
  static constexpr std::array<luaL_Reg, 9> kFunctions{{{"get", get},
                                                       {"set", set},
                                                       {"has", has},
                                                       {"event", event},
                                                       {"emcy", error},
                                                       {"emcy_over", error_over},
                                                       {"fault", fault},
                                                       {"print", say},
                                                       {"block", block}}};

 private:
  /// Throws ScriptError.
  void begin() {
    script_ = std::make_unique<Script>(name_, text_, seed_, kFunctions, this);
    incidents_ = script_->list("incidents", kMostIncidents);
    alarms_ = script_->list("alarms", kMostIncidents);
    for (const std::string& alarm : alarms_)
      if (std::ranges::find(incidents_, alarm) == incidents_.end())
        throw ScriptError(fmt::format("{}: alarms: \"{}\" is none of its incidents{}", name_, alarm,
                                      base::did_you_mean(alarm, incidents())),
                          0);
    points_ = declared_points(*script_);
  }

  void fail(const ScriptError& error, Time now) {
    failed_ = true;
    due_ = kNever;
    node_.tell(error.what(), now);
    node_.error(kScriptFailed, ErrorRegister::kGeneric,
                {static_cast<std::uint8_t>(error.line), static_cast<std::uint8_t>(error.line >> 8)}, now);
  }

  void count_updates(Time now) {
    if (failed_ || now != due_) return;
    if (std::exchange(millisecond_, now / kMillisecond) != now / kMillisecond) updates_ = 0;
    if (++updates_ > kMostUpdates)
      fail(ScriptError(name_ + ": update wants to be called more than 500 times in a millisecond", 0), now);
  }

  void store(const ObjectEntry& entry, std::uint8_t sub, std::uint64_t raw) {
    ObjectDictionary& dictionary = node_.dictionary();
    if (entry.index < object::kFirstManufacturer && entry.has(ObjectFlags::kWrite) && !quiet_) {
      std::array<std::uint8_t, 8> bytes{};
      store_little_endian(bytes, raw);
      node_.write_own(entry.index, sub, std::span(bytes).first(entry.capacity), now_);
      return;
    }
    const std::uint64_t before = dictionary.number(entry, sub);
    dictionary.set(entry.index, sub, raw);
    if (dictionary.number(entry, sub) == before || quiet_) return;
    if (updating_)
      changed_.emplace_back(entry.index, sub);
    else
      node_.changed(entry.index, sub, now_);
  }

  /// Called again by the first TPDO of these, which is sampled after all of them.
  void report(Time now) {
    while (!changed_.empty()) {
      const auto [index, sub] = changed_.back();
      changed_.pop_back();
      node_.changed(index, sub, now);
    }
  }

  void put_kept_inputs() {
    for (const auto& [place, value] : kept_)
      if (const auto entry = sim::find_number(node_.dictionary(), place.first, place.second))
        store(*entry, place.second, sim::to_raw(value, entry->type, entry->capacity));
  }

  double seconds(Time now) const { return static_cast<double>(now - began_at_) / kSecond; }
  /// The first microsecond not before it; kNever if that is in more than a hundred years.
  Time time_of(double seconds) const {
    if (!(seconds < 3.2e9)) return kNever;
    return began_at_ + static_cast<Time>(std::max(0.0, std::ceil(seconds * kSecond - 1e-3)));
  }

  /// Calls the script's function, if there is one, and returns its result; `now` is the last argument.
  template <class... Arguments>
  Script::Result call(const char* function, Time now, Arguments... arguments) {
    now_ = now;
    lines_ = 0;
    if (failed_) return {};
    try {
      const std::array<Script::Argument, sizeof...(arguments) + 1> all{arguments..., seconds(now)};
      return script_->call(function, all);
    } catch (const ScriptError& error) {
      fail(error, now);
      return {};
    }
  }

  sim::DeviceNode& node_;
  std::uint64_t seed_;
  std::string name_;
  std::string text_;
  std::unique_ptr<Script> script_;
  std::vector<std::string> incidents_, alarms_;
  std::vector<sim::Point> points_;
  std::map<std::pair<std::uint16_t, std::uint8_t>, double> given_;  ///< to inputs that the script has taken
  std::map<std::pair<std::uint16_t, std::uint8_t>, double> kept_;   ///< inputs that are their object's value
  std::set<std::string> present_;                                   ///< incidents
  std::vector<std::pair<std::uint16_t, std::uint8_t>> changed_;     ///< objects, by the present update()
  Time began_at_ = kNever;                                          ///< the script's time 0
  Time now_ = 0;
  Time due_ = kNever;
  Time millisecond_ = 0;  ///< in which updates_ are counted
  int updates_ = 0;
  int lines_ = 0;
  bool updating_ = false;   ///< in the script
  bool reporting_ = false;  ///< changed_
  bool quiet_ = true;       ///< values are set as at power-on: no events
  bool failed_ = false;
};

// Functions while a script is loaded for its declarations.
int no_number(lua_State* state) {
  lua_pushinteger(state, 0);
  return 1;
}
int no_block(lua_State* state) {
  lua_pushcfunction(state, no_number);
  return 1;
}

std::unique_ptr<Script> load(const std::string& name, std::string_view script) {
  auto functions = LuaDevice::kFunctions;
  for (luaL_Reg& function : functions)
    function.func = std::string_view(function.name) == kBlockType ? no_block : no_number;
  return std::make_unique<Script>(name, script, 0, functions, nullptr);
}

}  // namespace

std::string eds_of_script(const std::string& name, std::string_view script) {
  return declared_eds(*load(name, script), name, false);
}

ObjectChanges changes_of_script(const std::string& name, std::string_view script) {
  const auto loaded = load(name, script);
  return {declared_eds(*loaded, name, true), removed_objects(*loaded)};
}

std::unique_ptr<LuaBehaviour> make_lua_device(sim::DeviceNode& node, std::uint64_t seed,
                                              const std::string& name, const std::string& script) {
  return std::make_unique<LuaDevice>(node, seed, name, script);
}

}  // namespace cbcan::devices
