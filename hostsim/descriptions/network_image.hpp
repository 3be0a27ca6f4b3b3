// SPDX-License-Identifier: MIT
#pragma once

/// A network's description as the module's objects: the image of cbcan::NetworkObjects.

#include "descriptions/network_file.hpp"

namespace cbcan::descriptions {

/// Throws UsageError if it has more than 65,535 bytes, or a node has the module's ID.
Bytes image_of(const PlannedNetwork& network, std::uint8_t own_id, const std::string& name);

/// The image as a C++ header that defines `kNetwork`, for images of a board.
std::string header_of(const Bytes& image, const std::string& name);

// Parts of such headers: the first line, and an array of bytes.
std::string made_by(std::string_view program, std::string_view file);
std::string array_of(std::string_view array, const Bytes& bytes);

}  // namespace cbcan::descriptions
