// SPDX-License-Identifier: MIT
#include "fuzz/modbus_model.hpp"

#include <string_view>

namespace cbcan::fuzz {

namespace {

using Bytes = ModbusModel::Bytes;
using View = ModbusModel::View;

constexpr std::uint8_t kIllegalFunction = 1;
constexpr std::uint8_t kIllegalAddress = 2;
constexpr std::uint8_t kIllegalValue = 3;
constexpr std::uint8_t kNoPath = 10;

std::size_t word(View bytes, std::size_t at) {
  return bytes[at] * 256u + bytes[at + 1];
}

bool exist(std::size_t address, std::size_t count) {
  return address + count <= ModbusModel::kRegisters;
}

Bytes exception(View pdu, std::uint8_t code) {
  return {static_cast<std::uint8_t>(pdu[0] | 0x80), code};
}

/// V1.1b3, 6.21: conformity level 81h, three objects, and no more of them.
Bytes identification(View pdu) {
  using namespace std::string_view_literals;
  if (pdu.size() < 2) return exception(pdu, kIllegalValue);
  if (pdu[1] != 0x0E) return exception(pdu, kIllegalFunction);
  if (pdu.size() != 4 || pdu[2] == 0 || pdu[2] > 4) return exception(pdu, kIllegalValue);
  if (pdu[2] == 4 && pdu[3] > 2) return exception(pdu, kIllegalAddress);
  constexpr std::string_view kObjects[] = {
      "\x00\x02"
      "cb"sv,
      "\x01\x03"
      "can"sv,
      "\x02\x03"
      "1.0"sv};
  const std::size_t first = pdu[3] > 2 ? 0 : pdu[3];
  const std::size_t count = pdu[2] == 4 ? 1 : 3 - first;
  Bytes response{0x2B, 0x0E, pdu[2], 0x81, 0, 0, static_cast<std::uint8_t>(count)};
  for (std::size_t i = first; i < first + count; ++i)
    response.insert(response.end(), kObjects[i].begin(), kObjects[i].end());
  return response;
}

}  // namespace

void ModbusModel::receive(View bytes) {
  rest_.insert(rest_.end(), bytes.begin(), bytes.end());
  std::size_t at = 0;
  while (!closed_ && rest_.size() - at >= 6) {
    const View next = View(rest_).subspan(at);
    const std::size_t length = word(next, 4);
    closed_ = word(next, 2) != 0 || length < 2 || length > 254;
    if (closed_ || next.size() < 6 + length) break;
    respond(next.first(6 + length));
    at += 6 + length;
  }
  rest_.erase(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(at));
}

void ModbusModel::respond(View request) {
  const bool reached = request[6] < 2 || request[6] == 255;
  if (reached) ++requests_;
  const Bytes pdu = reached ? response_to(request.subspan(7)) : exception(request.subspan(7), kNoPath);
  responses_.insert(responses_.end(),
                    {request[0], request[1], 0, 0, 0, static_cast<std::uint8_t>(pdu.size() + 1), request[6]});
  responses_.insert(responses_.end(), pdu.begin(), pdu.end());
}

Bytes ModbusModel::response_to(View pdu) {
  switch (pdu[0]) {
    case 3: return read(pdu);
    case 6: return write_one(pdu);
    case 16: return write_many(pdu);
    case 22: return mask(pdu);
    case 23: return read_write(pdu);
    case 43: return identification(pdu);
    default: return exception(pdu, kIllegalFunction);
  }
}

Bytes ModbusModel::read(View pdu) {
  if (pdu.size() != 5 || word(pdu, 3) < 1 || word(pdu, 3) > 125) return exception(pdu, kIllegalValue);
  if (!exist(word(pdu, 1), word(pdu, 3))) return exception(pdu, kIllegalAddress);
  return load(3, word(pdu, 1), word(pdu, 3));
}

Bytes ModbusModel::write_one(View pdu) {
  if (pdu.size() != 5) return exception(pdu, kIllegalValue);
  if (!exist(word(pdu, 1), 1)) return exception(pdu, kIllegalAddress);
  store(word(pdu, 1), pdu.subspan(3));
  return {pdu.begin(), pdu.end()};
}

Bytes ModbusModel::write_many(View pdu) {
  if (pdu.size() < 6) return exception(pdu, kIllegalValue);
  const std::size_t count = word(pdu, 3);
  if (count < 1 || count > 123 || pdu[5] != 2 * count || pdu.size() != 6 + 2 * count)
    return exception(pdu, kIllegalValue);
  if (!exist(word(pdu, 1), count)) return exception(pdu, kIllegalAddress);
  store(word(pdu, 1), pdu.subspan(6));
  return {pdu.begin(), pdu.begin() + 5};
}

Bytes ModbusModel::mask(View pdu) {
  if (pdu.size() != 7) return exception(pdu, kIllegalValue);
  if (!exist(word(pdu, 1), 1)) return exception(pdu, kIllegalAddress);
  const std::size_t and_mask = word(pdu, 3);
  std::uint16_t& value = registers[word(pdu, 1)];
  value = static_cast<std::uint16_t>((value & and_mask) | (word(pdu, 5) & ~and_mask));
  return {pdu.begin(), pdu.end()};
}

/// The write comes before the read (V1.1b3, 6.17).
Bytes ModbusModel::read_write(View pdu) {
  if (pdu.size() < 10) return exception(pdu, kIllegalValue);
  const std::size_t reads = word(pdu, 3);
  const std::size_t writes = word(pdu, 7);
  if (reads < 1 || reads > 125 || writes < 1 || writes > 121) return exception(pdu, kIllegalValue);
  if (pdu[9] != 2 * writes || pdu.size() != 10 + 2 * writes) return exception(pdu, kIllegalValue);
  if (!exist(word(pdu, 1), reads) || !exist(word(pdu, 5), writes)) return exception(pdu, kIllegalAddress);
  store(word(pdu, 5), pdu.subspan(10));
  return load(23, word(pdu, 1), reads);
}

void ModbusModel::store(std::size_t address, View values) {
  for (std::size_t i = 0; i + 1 < values.size(); i += 2)
    registers[address++] = static_cast<std::uint16_t>(word(values, i));
}

Bytes ModbusModel::load(std::uint8_t function, std::size_t address, std::size_t count) const {
  Bytes response{function, static_cast<std::uint8_t>(2 * count)};
  for (std::size_t i = address; i < address + count; ++i) {
    response.push_back(static_cast<std::uint8_t>(registers[i] / 256));
    response.push_back(static_cast<std::uint8_t>(registers[i] % 256));
  }
  return response;
}

}  // namespace cbcan::fuzz
