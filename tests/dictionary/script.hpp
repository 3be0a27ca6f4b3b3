// SPDX-License-Identifier: MIT
#pragma once

/// Everything that the suite does with a device, by frames: the same for every kind of device. A transcript
/// has all frames in order, those to the device after ">".

#include "descriptions/dictionary_image.hpp"
#include "dictionary/bus.hpp"

namespace cbcan::test {

/// Reads all objects, and places that have none.
Frames read_all(Bus& bus, const descriptions::DictionaryImage& image, unsigned node = 5);
/// Writes each object: its value, limits and one beyond them, wrong lengths; and reads it.
Frames write_all(Bus& bus, const descriptions::DictionaryImage& image);
/// Maps each object into the first RPDO and the first TPDO, and exchanges it.
Frames map_all(Bus& bus, const descriptions::DictionaryImage& image);
/// 1010h, 1011h and resets.
Frames store_all(Bus& bus, const descriptions::DictionaryImage& image);
/// LSS: node ID 5 becomes 6, and is stored.
Frames change_node_id(Bus& bus, const descriptions::DictionaryImage& image);

}  // namespace cbcan::test
