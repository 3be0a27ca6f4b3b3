// SPDX-License-Identifier: MIT
#pragma once

#include <cctype>
#include <string>

namespace cbcan::contract {

/// "605#4000200100000000" to "t60584000200100000000", "705#R1" to "r7051": without the product's encoder.
inline std::string slcan_line(const std::string& frame) {
  const std::size_t hash = frame.find('#');
  std::string data = frame.substr(hash + 1);
  std::erase(data, ' ');
  const bool remote = data.starts_with('R');
  char type = remote ? 'r' : 't';
  if (hash == 8) type = static_cast<char>(std::toupper(type));
  std::string line = type + frame.substr(0, hash);
  if (remote) return line + (data.size() > 1 ? data.substr(1) : "0");
  return line + std::to_string(data.size() / 2) + data;
}

/// The reverse.
inline std::string candump_text(const std::string& line) {
  const std::size_t digits = std::isupper(static_cast<unsigned char>(line[0])) ? 8 : 3;
  const bool remote = line[0] == 'r' || line[0] == 'R';
  const std::string length = line.substr(1 + digits, 1);
  return line.substr(1, digits) + "#" + (remote ? "R" + length : line.substr(2 + digits));
}

/// Whether a line of an SLCAN adapter, or to one, is a frame.
inline bool is_slcan_frame(const std::string& line) {
  return !line.empty() && std::string("tTrR").find(line[0]) != std::string::npos;
}

}  // namespace cbcan::contract
