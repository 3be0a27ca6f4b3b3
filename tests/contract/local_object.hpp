// SPDX-License-Identifier: MIT
#pragma once

/// The own object dictionary, read and written with R3702 = 0.

#include <ostream>

#include "contract/window.hpp"

namespace cbcan::contract {

/// A number of up to four bytes, and its size.
struct Value {
  std::uint32_t number;
  std::uint16_t size;
  bool operator==(const Value&) const = default;
};

inline std::ostream& operator<<(std::ostream& out, const Value& value) {
  return out << value.number << " in " << value.size << " bytes";
}

inline Value read_local(Window& window, std::uint16_t index, std::uint16_t sub) {
  window.set(3706, {0, 0});
  window.read(0, index, sub, 128).check_done();
  return {window.abort_code(), window.reg(3705)};
}

struct Local {
  std::uint16_t index, sub;
  Value value;
};

inline void check_locals(Window& window, const std::vector<Local>& locals) {
  for (const auto& [index, sub, value] : locals) {
    INFO("object " << std::hex << index << " sub " << sub);
    CHECK(read_local(window, index, sub) == value);
  }
}

inline void check_read_only(Window& window, std::uint16_t index, std::uint16_t sub) {
  window.write(0, index, sub, 1, {1}).check_failed(0x06010002);
}

/// Writes a local object, and reads it back.
inline void check_kept(Window& window, std::uint16_t index, std::uint16_t sub, const Value& value) {
  window.configure(index, sub, value.size, words_of(value.number));
  CHECK(read_local(window, index, sub) == value);
}

/// Reads a local object of any length, as "0102AB".
inline std::string local_bytes(Window& window, std::uint16_t index, std::uint16_t sub) {
  window.read(0, index, sub, 128).check_done();
  const std::size_t size = window.reg(3705);
  std::string text;
  for (const std::uint16_t word : window.target().read(3706, (size + 1) / 2))
    text += hex_of(Words{word, static_cast<std::uint16_t>(word >> 8)});
  return text.substr(0, 2 * size);
}

inline void check_missing(Window& window, std::uint16_t index, std::uint16_t sub, std::uint32_t code) {
  INFO("object " << std::hex << index << " sub " << sub);
  window.read(0, index, sub, 128).check_failed(code);
}

}  // namespace cbcan::contract
