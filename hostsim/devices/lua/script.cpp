// SPDX-License-Identifier: MIT
#include "devices/lua/script.hpp"

#include <array>
#include <cstdlib>

#include "devices/lua/prelude.hpp"

namespace cbcan::devices {

namespace {

/// If the text begins with the bracket of a long string: one more than its number of '='; else 0.
std::size_t long_bracket(std::string_view text) {
  if (!text.starts_with('[')) return 0;
  const std::size_t second = text.find_first_not_of('=', 1);
  return second != std::string_view::npos && text[second] == '[' ? second : 0;
}

/// Length of the comment or string at the beginning of the text; 0 = none.
std::size_t skipped(std::string_view text) {
  const bool is_comment = text.starts_with("--");
  const std::string_view inside = is_comment ? text.substr(2) : text;
  const auto up_to = [&](std::string_view end, std::size_t from) {
    const std::size_t found = text.find(end, from);
    return found == std::string_view::npos ? text.size() : found + end.size();
  };
  if (const std::size_t bracket = long_bracket(inside); bracket != 0)
    return up_to("]" + std::string(bracket - 1, '=') + "]", 0);
  if (is_comment) return std::min(text.find_first_of("\r\n"), text.size());
  if (!text.starts_with('"') && !text.starts_with('\'')) return 0;
  std::size_t end = 1;
  while (end < text.size() && text[end] != text[0])
    end += text[end] == '\\' ? 2U : 1U;
  return std::min(end + 1, text.size());
}

/// Whether the operator % occurs outside strings and comments.
bool has_remainder(std::string_view program) {
  while (!program.empty() && program[0] != '%')
    program.remove_prefix(std::max<std::size_t>(1, skipped(program)));
  return !program.empty();
}

/// Whether a string of the program may contain the character 0: Lua compares such strings piece by piece.
bool has_zero(std::string_view program) {
  for (std::size_t at = program.find('\\'); at < program.size(); at = program.find('\\', at + 2)) {
    const std::string_view escape = program.substr(at + 1, 3);
    const std::string_view digits = escape.substr(0, escape.find_first_not_of("0123456789"));
    if (!digits.empty() && digits.find_first_not_of('0') == std::string_view::npos) return true;
    if (escape == "x00") return true;
    const std::size_t end = program.find_first_not_of('0', at + 3);
    if (escape.starts_with("u{") && end < program.size() && program[end] == '}') return true;
  }
  return program.find('\0') != std::string_view::npos;
}

constexpr const char* kTooMuch = "takes more memory than a script may have";
constexpr int kEveryInstruction = 1;
constexpr std::size_t kMostMetatables = 8;
/// These do not read through their first argument.
constexpr std::array<std::string_view, 3> kOfPlaces{"byte", "len", "sub"};

/// The top of the stack is a C function without upvalues.
bool is_without_upvalues(lua_State* state) {
  if (lua_iscfunction(state, -1) == 0) return false;
  const bool has_one = lua_getupvalue(state, -1, 1) != nullptr;
  if (has_one) lua_pop(state, 1);
  return !has_one;
}

/// The script's current line, found without allocating memory; 0 = not known.
int line_of(lua_State* state, lua_Debug& activation) {
  for (int level = 0; lua_getstack(state, level, &activation) != 0; ++level) {
    lua_getinfo(state, "Sl", &activation);
    if (activation.currentline > 0 && activation.source[0] == '@') return activation.currentline;
  }
  return 0;
}

/// Reports errors of the prelude at the script's line.
int blame_script(lua_State* state) {
  const char* message = lua_tostring(state, 1);
  if (message == nullptr || !std::string_view(message).starts_with("cbcan:")) return 1;
  lua_Debug activation;
  const int line = line_of(state, activation);
  lua_pushfstring(state, "%s:%d%s", line == 0 ? "" : activation.short_src, line,
                  message + std::string_view(message).find(": "));
  return 1;
}

/// Line in "tank.lua:12: ...", as Lua writes it.
int line_in(std::string_view message) {
  const std::size_t end = message.find(": ");
  const std::size_t begin = end == std::string_view::npos ? end : message.rfind(':', end - 1);
  return begin == std::string_view::npos ? 0 : std::atoi(message.data() + begin + 1);
}

}  // namespace

/// The functions that Lua calls: its allocator and hook, and those of scripts.
struct Script::Library {
  static void* allocate(void* self, void* block, std::size_t before, std::size_t wanted) {
    Script& script = *static_cast<Script*>(self);
    if (block == nullptr && before == LUA_TSTRING) script.count_longest(wanted, script.cost_.longest_string);
    if (block == nullptr && before == LUA_TSTRING)
      script.add_cost(wanted);  // numbers may have been converted
    if (block == nullptr && before == LUA_TFUNCTION)
      script.count_longest(wanted, script.cost_.largest_function);
    if (block == nullptr) before = 0;  // for a new block it is a kind of object
    void* made = nullptr;
    if (wanted == 0) {
      std::free(block);
    } else if (script.may_take(before, wanted)) {
      made = std::realloc(block, wanted);
    } else {
      script.end_call(kTooMuch);
    }
    if (wanted != 0 && made == nullptr) return nullptr;
    script.used_ += wanted - before;
    if (wanted > before) script.allocated_ += wanted - before;
    return made;
  }

  static void count(lua_State* state, lua_Debug* /*activation*/) {
    Script& script = from(state);
    script.spend(script.cost_.of_interval());
    script.update_cost();
  }

  static int cost(lua_State* state) {
    const double bytes = lua_tonumber(state, 1);
    from(state).spend(bytes > 0 ? static_cast<CostModel::Bytes>(std::min(bytes, 1e9)) : 0);
    return 0;
  }

  /// Calls a function of Lua's library, its upvalue, after counting the strings that it reads: its arguments
  /// from the first or the second on.
  template <int kFirst>
  static int counted(lua_State* state) {
    const int count = lua_gettop(state);
    CostModel::Bytes bytes = CostModel::kCall + static_cast<unsigned>(count);
    for (int i = kFirst; i <= count; ++i)
      if (lua_type(state, i) == LUA_TSTRING) bytes += lua_rawlen(state, i);
    from(state).spend(bytes);
    return lua_tocfunction(state, lua_upvalueindex(1))(state);
  }

  /// Wraps all functions of the table on top, which is popped, in counted(); those with upvalues take no
  /// strings.
  static void count_functions(lua_State* state) {
    for (lua_pushnil(state); lua_next(state, -2) != 0; lua_pop(state, 1)) {
      if (!is_without_upvalues(state)) continue;
      const bool of_places = std::ranges::find(kOfPlaces, lua_tostring(state, -2)) != kOfPlaces.end();
      lua_pushvalue(state, -2);
      lua_pushvalue(state, -2);
      lua_pushcclosure(state, of_places ? counted<2> : counted<1>, 1);
      lua_rawset(state, -5);
    }
    lua_pop(state, 1);
  }

  /// Converts like tostring, but without addresses.
  static int to_string(lua_State* state) {
    luaL_checkany(state, 1);
    const int type = lua_type(state, 1);
    if (type == LUA_TNUMBER) from(state).spend(CostModel::kNumber);
    if ((type == LUA_TTABLE || type == LUA_TFUNCTION) &&
        luaL_getmetafield(state, 1, "__tostring") == LUA_TNIL)
      lua_pushstring(state, lua_typename(state, type));
    else
      luaL_tolstring(state, 1, nullptr);
    return 1;
  }

  /// Counts the metatable on top. The registry keeps all of them, so that each counts once.
  static void count_metatable(lua_State* state) {
    lua_pushvalue(state, -1);
    const bool known = lua_rawget(state, LUA_REGISTRYINDEX) != LUA_TNIL;
    lua_pop(state, 1);
    if (known) return;
    if (++from(state).cost_.metatables > kMostMetatables)
      luaL_error(state, "setmetatable: more than %d metatables; give tables one together",
                 static_cast<int>(kMostMetatables));
    lua_pushvalue(state, -1);
    lua_pushboolean(state, 1);
    lua_rawset(state, LUA_REGISTRYINDEX);
    from(state).update_cost();
  }

  /// Refuses __gc and __mode: a script must not notice garbage collection.
  static int set_metatable(lua_State* state) {
    luaL_checktype(state, 1, LUA_TTABLE);
    luaL_argexpected(state, lua_isnoneornil(state, 2) || lua_istable(state, 2), 2, "nil or table");
    lua_settop(state, 2);
    for (const char* name : {"__gc", "__mode"}) {
      if (lua_isnil(state, 2)) break;
      lua_pushstring(state, name);
      if (lua_rawget(state, 2) != LUA_TNIL) return luaL_error(state, "setmetatable: there is no %s", name);
      lua_pop(state, 1);
    }
    if (luaL_getmetafield(state, 1, "__metatable") != LUA_TNIL)
      return luaL_error(state, "cannot change a protected metatable");
    lua_settop(state, 2);
    if (!lua_isnil(state, 2)) count_metatable(state);
    lua_setmetatable(state, 1);
    return 1;
  }

  static int protected_call(lua_State* state) {
    luaL_checkany(state, 1);
    const bool good = lua_pcall(state, lua_gettop(state) - 1, LUA_MULTRET, 0) == LUA_OK;
    if (!good) from(state).spend(CostModel::kError);
    lua_pushboolean(state, good ? 1 : 0);
    lua_insert(state, 1);
    return lua_gettop(state);
  }

  static void load(lua_State* state, std::uint64_t seed, std::span<const luaL_Reg> functions) {
    for (const luaL_Reg& library :
         {luaL_Reg{LUA_GNAME, luaopen_base}, luaL_Reg{LUA_TABLIBNAME, luaopen_table},
          luaL_Reg{LUA_STRLIBNAME, luaopen_string}, luaL_Reg{LUA_MATHLIBNAME, luaopen_math}})
      luaL_requiref(state, library.name, library.func, 1);
    lua_getfield(state, -1, "randomseed");
    lua_pushinteger(state, static_cast<lua_Integer>(seed));
    lua_pushinteger(state, 0);
    lua_call(state, 2, 0);
    for (const luaL_Reg& own : {luaL_Reg{"tostring", to_string}, luaL_Reg{"setmetatable", set_metatable},
                                luaL_Reg{"pcall", protected_call}, luaL_Reg{"cost", cost}})
      lua_register(state, own.name, own.func);
    if (luaL_loadbufferx(state, kPrelude.data(), kPrelude.size(), "=cbcan", "t") != LUA_OK) lua_error(state);
    lua_call(state, 0, 0);
    for (const auto& [name, function] : functions)
      lua_register(state, name, function);
    for (const char* library : {LUA_GNAME, LUA_TABLIBNAME, LUA_STRLIBNAME, LUA_MATHLIBNAME}) {
      lua_getglobal(state, library);
      count_functions(state);
    }
    lua_pushliteral(state, "");
    lua_getmetatable(state, -1);
    count_functions(state);
  }
};

// ---- Limits

bool Script::may_take(std::size_t before, std::size_t wanted) {
  if (wanted <= before) return true;
  return wanted <= kMostBlock && used_ + outside_ - before + wanted <= kMostMemory &&
         allocated_ + wanted - before <= kMostAllocated;
}

void Script::charge(lua_State* state, std::size_t bytes) {
  Script& script = from(state);
  if (!script.may_take(0, bytes)) {
    script.end_call(kTooMuch);
    luaL_error(state, "%s", kTooMuch);
  }
  script.outside_ += bytes;
}

/// Lets each further instruction fail, so that pcall cannot continue the script.
void Script::end_call(const char* why) {
  if (state_ == nullptr || !why_.empty()) return;
  lua_Debug activation;
  line_ = line_of(state_, activation);
  why_ = line_ == 0 ? why : std::string(activation.short_src) + ":" + std::to_string(line_) + ": " + why;
  lua_sethook(state_, Library::count, LUA_MASKCOUNT, kEveryInstruction);
}

void Script::add_cost(CostModel::Bytes bytes) {
  cost_.spend(bytes);
  if (cost_.steps() >= most_)
    end_call(("more than " + std::to_string(most_) + " instructions in one call").c_str());
}

void Script::spend(CostModel::Bytes bytes) {
  add_cost(bytes);
  if (!why_.empty()) luaL_error(state_, "the call has been ended");
}

void Script::update_cost() {
  cost_.update(used_ - std::min(used_, base_));
  if (why_.empty()) lua_sethook(state_, Library::count, LUA_MASKCOUNT, cost_.interval());
}

/// An object much larger than all before changes the cost of instructions immediately.
void Script::count_longest(std::size_t size, std::size_t& longest) {
  if (size <= longest) return;
  const bool at_once = state_ != nullptr && size > 2 * longest;
  longest = size;
  if (at_once) update_cost();
}

/// Calls `what` with the state, in Lua's protected mode. Throws ScriptError.
template <class What>
void Script::run_protected(What what) {
  allocated_ = 0;
  why_.clear();
  cost_.begin_call();
  update_cost();
  lua_pushcfunction(state_, blame_script);
  lua_pushcfunction(state_, [](lua_State* state) {
    (*static_cast<What*>(lua_touserdata(state, 1)))(state);
    return 0;
  });
  lua_pushlightuserdata(state_, &what);
  const bool good = lua_pcall(state_, 1, 0, 1) == LUA_OK;
  std::string message = why_;
  if (!good && message.empty()) {
    const bool is_text = lua_type(state_, -1) == LUA_TSTRING;
    message = is_text ? lua_tostring(state_, -1) : "an error that is no text";
    line_ = line_in(message);
  }
  lua_settop(state_, 0);
  if (good && message.empty()) return;
  throw ScriptError(line_ == 0 ? name_ + ": " + message : message, line_);
}

// ---- Calls

Script::Script(const std::string& name, std::string_view text, std::uint64_t seed,
               std::span<const luaL_Reg> functions, void* owner)
    : name_(name), owner_(owner) {
  state_ = lua_newstate(Library::allocate, this);
  if (state_ == nullptr) throw std::bad_alloc();
  *static_cast<Script**>(lua_getextraspace(state_)) = this;
  try {
    run_protected([&](lua_State* state) {
      Library::load(state, seed, functions);
      base_ = used_;
      cost_.has_remainder = has_remainder(text);
      if (has_zero(text)) luaL_error(state, "a text cannot have the character 0");
      lua_pushfstring(state, "@%s", name.c_str());
      if (luaL_loadbufferx(state, text.data(), text.size(), lua_tostring(state, -1), "t") != LUA_OK)
        lua_error(state);
      lua_call(state, 0, 0);
    });
    most_ = kMostInstructions;
  } catch (...) {
    lua_close(state_);
    throw;
  }
}

Script::Result Script::call(const char* function, std::span<const Argument> arguments) {
  Result result;
  run_protected([&](lua_State* state) {
    if (lua_getglobal(state, function) == LUA_TNIL) return;
    for (const Argument& argument : arguments) {
      if (const auto* whole = std::get_if<lua_Integer>(&argument)) lua_pushinteger(state, *whole);
      if (const auto* number = std::get_if<double>(&argument)) lua_pushnumber(state, *number);
      if (const auto* flag = std::get_if<bool>(&argument)) lua_pushboolean(state, *flag ? 1 : 0);
      if (const auto* text = std::get_if<std::string_view>(&argument))
        lua_pushlstring(state, text->data(), text->size());
    }
    lua_call(state, static_cast<int>(arguments.size()), 1);
    const int type = lua_type(state, -1);
    if (type == LUA_TBOOLEAN) result = lua_toboolean(state, -1) != 0;
    if (type == LUA_TNUMBER) result = lua_tonumber(state, -1);
    if (type > LUA_TBOOLEAN && type != LUA_TNUMBER)
      luaL_error(state, "%s has returned a %s", function, lua_typename(state, type));
  });
  return result;
}

namespace {

/// The string at this place, to be copied. No destructor may be pending.
std::string_view charged_text(lua_State* state, int place) {
  constexpr std::size_t kOverhead = 100;  // of a copy: a string in a map
  std::size_t length = 0;
  const char* const text = lua_tolstring(state, place, &length);
  length = std::min(length, Script::kMostText + 1);
  Script::charge(state, kOverhead + length);
  return {text, length};
}

/// Appends the strings of the list on the stack.
void read_list(lua_State* state, std::vector<std::string>& texts, std::size_t most) {
  for (lua_Integer i = 1; texts.size() < most && lua_rawgeti(state, -1, i) == LUA_TSTRING; ++i) {
    texts.emplace_back(charged_text(state, -1));
    lua_pop(state, 1);
  }
}

/// The table on the stack.
void read_record(lua_State* state, Script::Record& record) {
  constexpr std::size_t kMostTexts = 64;
  for (lua_pushnil(state); lua_next(state, -2) != 0; lua_pop(state, 1)) {
    const int value = lua_gettop(state);
    if (lua_type(state, value - 1) != LUA_TSTRING) continue;
    const std::string_view key = charged_text(state, value - 1);
    const int type = lua_type(state, value);
    const std::string_view text = type == LUA_TSTRING ? charged_text(state, value) : std::string_view();
    if (type == LUA_TNUMBER) record.numbers[std::string(key)].value = lua_tonumber(state, value);
    if (lua_isinteger(state, value)) record.numbers[std::string(key)].whole = lua_tointeger(state, value);
    if (type == LUA_TBOOLEAN) record.numbers[std::string(key)].value = lua_toboolean(state, value);
    if (type == LUA_TSTRING) record.texts[std::string(key)] = {std::string(text)};
    if (type == LUA_TTABLE) {
      std::vector<std::string>& texts =
          record.texts[std::string(key)];  // no temporary is left in read_list()
      read_list(state, texts, kMostTexts);
    }
    lua_settop(state, value);
  }
}

bool has_long_text(const Script::Record& record) {
  const auto is_long = [](const std::string& text) { return text.size() > Script::kMostText; };
  return std::ranges::any_of(record.texts,
                             [&](const auto& field) { return std::ranges::any_of(field.second, is_long); });
}

}  // namespace

std::vector<std::string> Script::list(const char* name, std::size_t most) {
  std::vector<std::string> texts;
  run_protected([&](lua_State* state) {
    if (lua_getglobal(state, name) == LUA_TTABLE) read_list(state, texts, most);
  });
  for (const std::string& text : texts)
    if (text.size() > kMostText)
      throw ScriptError(
          name_ + ": " + name + ": a text has more than " + std::to_string(kMostText) + " letters", 0);
  return texts;
}

std::vector<Script::Record> Script::records(const char* name, std::size_t most) {
  std::vector<Record> records;
  run_protected([&](lua_State* state) {
    if (lua_getglobal(state, name) != LUA_TTABLE) return;
    for (lua_Integer i = 1; records.size() < most && lua_rawgeti(state, -1, i) == LUA_TTABLE; ++i) {
      read_record(state, records.emplace_back());
      lua_pop(state, 1);
      if (has_long_text(records.back())) return;
    }
    if (!records.empty()) return;
    lua_settop(state, 2);
    read_record(state, records.emplace_back());
  });
  return records;
}

}  // namespace cbcan::devices
