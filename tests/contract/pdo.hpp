// SPDX-License-Identifier: MIT
#pragma once

/// PDOs of the own node, set up through the window as by a PLC program.

#include "contract/local_object.hpp"

namespace cbcan::contract {

inline constexpr unsigned kInputs = 3800, kOutputs = 3864;

/// Sets mapping and transmission type of PDO `index` (1400h.., 1800h..), which stays invalid. Entries are as in
/// 1600h.. and 1A00h..: index, sub-index, bits.
inline void prepare_pdo(Window& window, unsigned index, std::uint16_t type,
                        const std::vector<std::uint32_t>& objects) {
  INFO("PDO " << std::hex << index);
  const auto mapping = static_cast<std::uint16_t>(index + 0x200);
  for (std::uint16_t k = 0; k < objects.size(); ++k)
    window.put(mapping, static_cast<std::uint16_t>(k + 1), objects[k]);
  window.configure(mapping, 0, 1, {static_cast<std::uint16_t>(objects.size())});
  window.configure(static_cast<std::uint16_t>(index), 2, 1, {type});
}

inline void set_up_pdo(Window& window, unsigned index, std::uint32_t cob_id, std::uint16_t type,
                       const std::vector<std::uint32_t>& objects) {
  prepare_pdo(window, index, type, objects);
  window.put(index, 1, cob_id);
}

/// NMT to the own node.
inline Window& command_own_node(Window& window, std::uint16_t service) {
  window.write(0, 0x1F82, Window::kOwnNode, 1, {service}).check_done();
  return window;
}

struct PdoSetUp {
  unsigned index;
  std::uint32_t cob_id;
  std::uint16_t type;
  std::vector<std::uint32_t> objects;
};

/// Starts the own node, with PDOs.
inline Window& start_own_node(Window& window, const std::vector<PdoSetUp>& pdos = {}) {
  for (const auto& [index, cob_id, type, objects] : pdos)
    set_up_pdo(window, index, cob_id, type, objects);
  return command_own_node(window, 1);
}

inline Words inputs(Window& window) {
  return window.target().read(kInputs, 64);
}

/// 64 registers: 0 except those given, by their number.
inline Words registers_with(const std::map<unsigned, std::uint16_t>& words) {
  Words all(64);
  for (const auto& [number, word] : words)
    all.at(number) = word;
  return all;
}

}  // namespace cbcan::contract
