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

std::optional<Response> response_in(std::span<const std::uint8_t> bytes, std::uint8_t unit,
                                    const Request& request) {
  constexpr std::size_t kExceptionSize = kHead + 1, kWriteSize = kHead + 4;
  const std::uint8_t function = function_of(request);
  const std::size_t data = 2u * request.count;
  if (bytes.size() < kExceptionSize || bytes[0] != unit) return std::nullopt;
  if (bytes[1] == (function | kException) && bytes.size() == kExceptionSize && bytes[2] != 0)
    return Response{.exception = bytes[2]};
  if (bytes[1] != function || bytes.size() != (data == 0 ? kWriteSize : kHead + 1 + data))
    return std::nullopt;
  if (data != 0 && bytes[2] != data) return std::nullopt;
  Response response;
  for (std::size_t at = kHead + 1; at < kHead + 1 + data; at += 2)
    response.words.push_back(static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]));
  return response;
}

}  // namespace cbcan::window
