// SPDX-License-Identifier: MIT
#pragma once

/// A sandboxed Lua script: the functions that it can call are defined here, its resources are limited, and it
/// behaves identically in each run.

#include <lua.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sim/behaviour.hpp"

namespace cbcan::devices {

/// What a call of a script has cost, in bytes that Lua has read or may have read. 16 bytes are a step; limits
/// are in steps. An instruction costs one step, and further ones for the data that it may read.
class CostModel {
 public:
  using Bytes = std::size_t;
  static constexpr Bytes kStep = 16;
  static constexpr Bytes kCall = 8;      ///< of a function of Lua's library; each argument costs 1 more
  static constexpr Bytes kNumber = 160;  ///< converting a number to a string
  static constexpr Bytes kError =
      16'000;  ///< to name the faulty value, Lua searches all instructions before it

  // What one instruction may read.
  Bytes longest_string = 0;    ///< of all so far
  Bytes largest_function = 0;  ///< the same
  std::size_t metatables = 0;  ///< each access to a table may follow a chain of them
  bool has_remainder = false;  ///< the script uses the operator %

  void begin_call() { spent_ = 0; }
  void spend(Bytes bytes) { spent_ += bytes; }
  /// Steps of the call so far.
  std::size_t steps() const { return spent_ / kStep; }

  /// Call it when any of these has changed. `memory`: of the script, in bytes.
  void update(Bytes memory) {
    const std::size_t shared = largest_function / sizeof(void*);  // variables
    steps_ = static_cast<int>(longest_string / kStringBytes + memory / kMemoryBytes +
                              metatables / kMetatables + shared * shared / kSharedSquare) +
             (has_remainder ? kRemainder : 1);
  }
  /// Instructions between two updates.
  int interval() const { return std::max(1, kIntervalSteps / steps_); }
  Bytes of_interval() const { return static_cast<Bytes>(interval() * steps_) * kStep; }

 private:
  // Amounts of data that make an instruction cost one step more.
  static constexpr Bytes kStringBytes = 200;
  static constexpr Bytes kMemoryBytes = 6000;
  static constexpr std::size_t kMetatables = 4;
  /// For each shared variable of a new function, Lua walks along the list of all shared variables.
  static constexpr std::size_t kSharedSquare = 500;
  /// Steps of each instruction: the remainder of two floats takes a round for each bit between their
  /// exponents.
  static constexpr int kRemainder = 16;
  static constexpr int kIntervalSteps = 1000;

  int steps_ = 1;  ///< of an instruction
  Bytes spent_ = 0;
};

/// An error of a script: "tank.lua:12: attempt to ...".
class ScriptError : public sim::BehaviourProblem {
 public:
  ScriptError(const std::string& what, int in_line) : BehaviourProblem(what), line(in_line) {}
  int line;  ///< 0 = not known
};

class Script {
 public:
  // Limits of one call.
  /// Steps, see CostModel: instructions of Lua's virtual machine and work of its library.
  static constexpr std::size_t kMostInstructions = 100'000;
  /// When the script is started.
  static constexpr std::size_t kMostAtStart = 1'000'000;
  static constexpr std::size_t kMostAllocated = std::size_t{32} << 20;
  // Limit of the script.
  static constexpr std::size_t kMostMemory = std::size_t{4} << 20;
  // Limit of one string or table.
  static constexpr std::size_t kMostBlock = std::size_t{256} << 10;
  /// Letters of a text in list() and records(): a line of an EDS has 255 characters. A longer one is cut
  /// after one more.
  static constexpr std::size_t kMostText = 200;

  using Argument = std::variant<lua_Integer, double, bool, std::string_view>;
  /// What a function has returned; monostate = nothing.
  using Result = std::variant<std::monostate, bool, double>;

  /// Loads the script and runs it once. `functions` find `owner` by owner_of(). Throws ScriptError.
  Script(const std::string& name, std::string_view text, std::uint64_t seed,
         std::span<const luaL_Reg> functions, void* owner);
  ~Script() { lua_close(state_); }
  Script(const Script&) = delete;
  Script& operator=(const Script&) = delete;

  /// Calls a function of the script; nothing if there is none of this name. Throws ScriptError.
  Result call(const char* function, std::span<const Argument> arguments);

  /// The strings in a list of this name, at most `most`; none longer than kMostText. Throws ScriptError.
  std::vector<std::string> list(const char* name, std::size_t most);

  /// The fields of a table: numbers, and texts or lists of them.
  struct Record {
    struct Number {
      double value = 0;
      std::optional<lua_Integer> whole{};  ///< if Lua has it as an integer
    };
    std::map<std::string, Number> numbers;
    std::map<std::string, std::vector<std::string>> texts;
  };
  /// The tables in a list of this name, at most `most`, up to the first with a text longer than kMostText; a
  /// table that is no such list is one itself. Throws ScriptError.
  std::vector<Record> records(const char* name, std::size_t most);

  /// Memory outside Lua that the script causes counts in its own: until release(), or its end. charge() is an
  /// error of the script if there is too much.
  static void charge(lua_State* state, std::size_t bytes);
  static void release(lua_State* state, std::size_t bytes) { from(state).outside_ -= bytes; }

  const std::string& name() const { return name_; }
  static void* owner_of(lua_State* state) { return from(state).owner_; }

 private:
  static Script& from(lua_State* state) { return **static_cast<Script**>(lua_getextraspace(state)); }
  struct Library;  ///< the functions that Lua calls
  bool may_take(std::size_t before, std::size_t wanted);
  void end_call(const char* why);
  void update_cost();
  void count_longest(std::size_t size, std::size_t& longest);
  void add_cost(CostModel::Bytes bytes);
  void spend(CostModel::Bytes bytes);
  template <class What>
  void run_protected(What what);

  lua_State* state_ = nullptr;
  std::string name_;
  void* owner_;
  std::size_t used_ = 0;
  std::size_t outside_ = 0;  ///< see charge()
  std::size_t allocated_ = 0;
  std::size_t base_ = 0;  ///< used_ before the script is loaded
  CostModel cost_;
  std::size_t most_ = kMostAtStart;
  std::string why_ = {};  ///< why the call has been ended; empty = it has not
  int line_ = 0;
};

// What a script declares in its tables `device` and `objects`: points for people, and for a device without
// an EDS file the whole dictionary. docs/how-to/lua-device.md is the manual.

/// Points of the objects with `show`: inputs, then outputs, then curves. Throws ScriptError.
std::vector<sim::Point> declared_points(Script& script);

/// See ObjectChanges of lua_device.hpp. Throws ScriptError.
std::vector<std::uint16_t> removed_objects(Script& script);

/// An EDS file with these objects, those that CiA 301 requires, heartbeat, EMCY, stored parameters, and PDOs
/// with the default mapping. `file`: its name, of the script. `is_beside`: objects without a type are those
/// of the device. Throws ScriptError.
std::string declared_eds(Script& script, std::string_view file, bool is_beside);

}  // namespace cbcan::devices
