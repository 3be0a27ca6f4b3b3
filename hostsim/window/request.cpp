// SPDX-License-Identifier: MIT
#include "window/request.hpp"

namespace cbcan::window {

namespace {

constexpr std::uint8_t kReadRegisters = 3;
constexpr std::uint8_t kWriteRegisters = 16;
constexpr std::uint8_t kWriteAndReadRegisters = 23;
constexpr std::uint8_t kException = 0x80;
constexpr std::size_t kHead = 2;  ///< unit ID and function code

void append(std::vector<std::uint8_t>& bytes, std::size_t word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

std::uint8_t function_of(const Request& request) {
  if (request.words.empty()) return kReadRegisters;
  return request.count == 0 ? kWriteRegisters : kWriteAndReadRegisters;
}

}  // namespace

/// V1.1b3, 6.3, 6.12 and 6.17
std::vector<std::uint8_t> bytes_of(std::uint8_t unit, const Request& request) {
  std::vector<std::uint8_t> bytes{unit, function_of(request)};
  if (request.count > 0) {
    append(bytes, request.read_address);
    append(bytes, request.count);
  }
  if (request.words.empty()) return bytes;
  append(bytes, request.write_address);
  append(bytes, request.words.size());
  bytes.push_back(static_cast<std::uint8_t>(2 * request.words.size()));
  for (const std::uint16_t word : request.words)
    append(bytes, word);
  return bytes;
}

Expected expected_by(std::uint8_t unit, const Request& request) {
  return {unit, function_of(request), request.count};
}

std::size_t Expected::size(std::uint8_t function_code) const {
  constexpr std::size_t kExceptionSize = kHead + 1, kWriteSize = kHead + 4;
  if ((function_code & kException) != 0) return kExceptionSize;
  return words == 0 ? kWriteSize : kHead + 1 + 2u * words;
}

std::optional<Response> Expected::in(std::span<const std::uint8_t> bytes) const {
  if (bytes.size() < kHead || bytes[0] != unit || bytes.size() != size(bytes[1])) return std::nullopt;
  if (bytes[1] == (function | kException) && bytes[2] != 0) return Response{.exception = bytes[2]};
  if (bytes[1] != function || (words != 0 && bytes[2] != 2u * words)) return std::nullopt;
  Response response;
  for (std::size_t i = 0; i < words; ++i)
    response.words.push_back(
        static_cast<std::uint16_t>(bytes[kHead + 1 + 2 * i] << 8 | bytes[kHead + 2 + 2 * i]));
  return response;
}

}  // namespace cbcan::window
