// SPDX-License-Identifier: MIT
#pragma once

/// Nodes from hand-written EDS files with the usual defects of vendor files, and the program that moves a
/// drive.

#include "descriptions/eds_reader.hpp"
#include "devices/devices.hpp"
#include "support/eds_text.hpp"
#include "support/world_bench.hpp"

namespace cbcan::test {

/// A drive as in a CiA 402 template: no values.
inline const std::vector<Line> kTemplate{
    {"1000", "7", "ro", ""}, {"6007", "3", "rw", ""},  {"6040", "6", "rww", ""}, {"6041", "6", "ro", ""},
    {"605A", "3", "rw", ""}, {"6060", "2", "rww", ""}, {"6061", "2", "ro", ""},  {"6064", "4", "ro", ""},
    {"6065", "7", "rw", ""}, {"6067", "7", "rw", ""},  {"606C", "4", "ro", ""},  {"607A", "4", "rww", ""},
    {"607F", "7", "rw", ""}, {"6080", "7", "rw", ""},  {"6081", "7", "rw", ""},  {"6083", "7", "rw", ""},
    {"6084", "7", "rw", ""}, {"60FF", "4", "rww", ""}, {"6502", "7", "ro", ""},
};

/// The template with lines replaced; a line of type "-" removes one.
inline std::string file_with(const std::vector<Line>& changes) {
  std::string text;
  for (Line line : kTemplate) {
    for (const Line& change : changes)
      if (change.index == line.index) line = change;
    if (line.type != "-") text += text_of(line);
  }
  return text;
}

/// Node 5 from a file, and the master's program.
struct Plant {
  /// With the device of 1000h, or another.
  explicit Plant(const std::string& text, const sim::BehaviourMaker& maker = nullptr) {
    descriptions::DictionaryImage image =
        descriptions::dictionary_image(descriptions::read(text, "x.eds", std::uint8_t{5}, devices::standard_type).device);
    sim::NodeParts parts;
    parts.behaviour = maker;
    if (!maker)
      parts.behaviour = devices::device_for(ObjectDictionary(image.entries, image.values, nullptr)).make;
    parts.node_id = 5;
    parts.image = std::move(image);
    node = &bench.world.add_node(std::move(parts));
    bench.start().expect("705#00");
  }
  void write(const std::string& multiplexer, const std::string& bytes, const std::string& command = "2B") {
    bench.write("605#" + command + multiplexer + bytes);
  }
  void enable(const std::string& mode) {
    write("606000", mode + "000000", "2F");
    for (const char* word : {"06000000", "07000000", "0F000000"})
      write("406000", word);
  }
  void move_to(const char* position) {
    enable("01");
    write("7A6000", position, "23");
    write("406000", "1F000000");
    bench.pass(10 * kSecond);
  }
  std::int32_t get(std::uint16_t index) {
    node->bring_up_to_date(bench.now);
    return static_cast<std::int32_t>(node->device().dictionary().get(index, 0));
  }
  WorldBench bench;
  sim::Node* node = nullptr;
};

}  // namespace cbcan::test
