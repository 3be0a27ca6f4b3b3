// SPDX-License-Identifier: MIT
// Every way to split a stream of Modbus TCP into reads, every header of the kinds that framing distinguishes,
// and every length, quantity and byte count of a request; compared with the fuzzers' model, which is written
// from the specification and shares no code with the product.

#include <sys/socket.h>

#include "bytes.hpp"
#include "fuzz/modbus_model.hpp"
#include "io/modbus/modbus_tcp.hpp"
#include "support/catch.hpp"
#include "support/register_unit.hpp"

namespace cbcan::io {
namespace {

using fuzz::ModbusModel;
using test::Bytes;
using test::hex;

const std::vector<std::uint16_t> kAtStart(ModbusModel::kRegisters, 0x1234);

/// A server, and one client after another, each a socket pair.
struct Line final : private cbcan::test::RegisterUnit {
  Line() : RegisterUnit(kAtStart) {}

  /// The responses when `stream` is sent in pieces: bit i of `cuts` = a piece ends after byte i. Sends no
  /// more once the server has closed the connection.
  void check(const Bytes& stream, std::uint64_t cuts) {
    words = kAtStart;
    ModbusModel model(kAtStart);
    model.receive(stream);
    int pair[2];
    REQUIRE(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair) == 0);
    const Descriptor client(pair[0]);
    modbus_.adopt(Descriptor(pair[1]));
    for (std::size_t begin = 0, i = 0; i < stream.size(); ++i)
      if (i + 1 == stream.size() || (i < 64 && (cuts >> i & 1) != 0)) {
        ::send(client.get(), stream.data() + begin, i + 1 - begin, MSG_NOSIGNAL);
        reactor_.poll(0);
        begin = i + 1;
      }
    while (reactor_.poll(0) != 0) {
    }
    const bool open = modbus_.clients() == 1;
    if (responses(client) != model.responses()) FAIL("responses, cuts " << cuts);
    if (words != model.registers) FAIL("registers, cuts " << cuts);
    if (open == model.closed() || (modbus_.next_deadline() != kNever) != model.waits())
      FAIL("end, cuts " << cuts);
    ++streams;
    if (open) ::shutdown(client.get(), SHUT_WR), reactor_.poll(0);
    if (modbus_.clients() != 0) FAIL("client");
  }

  std::size_t streams = 0;

 private:
  static Bytes responses(const Descriptor& client) {
    Bytes bytes(4096);
    const ssize_t size = ::recv(client.get(), bytes.data(), bytes.size(), 0);
    bytes.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
    return bytes;
  }

  Reactor reactor_;
  protocols::ModbusServer protocol_{std::array<protocols::ModbusUnit*, 1>{this}, {"cb", "can", "1.0"}};
  ModbusTcp modbus_{reactor_, {"127.0.0.1", 0}, protocol_, [](const std::string&) {}};
};

TEST_CASE("Modbus TCP: two requests in every combination of cuts") {
  Line line;
  const Bytes two_short = hex("00 01 00 00 00 02 01 63 00 02 00 00 00 02 01 2B");
  for (std::uint64_t cuts = 0; cuts < 1u << (two_short.size() - 1); ++cuts)
    line.check(two_short, cuts);
  CHECK(line.streams == 32'768);
}

TEST_CASE("Modbus TCP: a write, a read and what cannot be Modbus, in every combination of up to three cuts") {
  Line line;
  const Bytes stream = hex(
      "00 01 00 00 00 09 01 10 00 05 00 01 02 BE EF 00 02 00 00 00 06 01 03 00 05 00 01 00 03 00 01 00 06 01 "
      "03 00 05 00 01");
  for (std::size_t a = 0; a < stream.size(); ++a)
    for (std::size_t b = a; b < stream.size(); ++b)
      for (std::size_t c = b; c < stream.size(); ++c)
        line.check(stream, 1ull << a | 1ull << b | 1ull << c);
  CHECK(line.streams == 10'660);  // 39 * 40 * 41 / 6
}

/// Protocol IDs and lengths around 0, 2 and 254, unit IDs around 0, 1 and 255; PDUs that write, that read and
/// that are refused. Bytes after the length begin the next header.
TEST_CASE("Modbus TCP: every header of those kinds, in front of every kind of request") {
  Line line;
  const Bytes bytes_of_protocol{0, 1, 255}, lengths_high{0, 1, 255},
      lengths_low{0, 1, 2, 3, 5, 6, 7, 11, 253, 254, 255}, units{0, 1, 2, 255};
  for (const Bytes& pdu : {hex("06 00 07 BE EF"), hex("03 00 07 00 01"), hex("63")})
    for (const std::uint8_t protocol_high : bytes_of_protocol)
      for (const std::uint8_t protocol_low : bytes_of_protocol)
        for (const std::uint8_t length_high : lengths_high)
          for (const std::uint8_t length_low : lengths_low)
            for (const std::uint8_t unit : units) {
              Bytes stream{0xBE, 0xEF, protocol_high, protocol_low, length_high, length_low, unit};
              for (int i = 0; i < 60; ++i)  // enough for the longest length
                stream.insert(stream.end(), pdu.begin(), pdu.end());
              line.check(stream, 0);
            }
  CHECK(line.streams == 3 * 3 * 3 * 3 * 11 * 4);
}

// ---- Requests

/// The expected exception of a request to R0..R4167; 0 = none (V1.1b3, the state diagram of each function).
int exception_of(const std::uint8_t* pdu, std::size_t size) {
  const auto word = [pdu](std::size_t at) { return pdu[at] * 256u + pdu[at + 1]; };
  const auto address = [](std::size_t first, std::size_t count) { return first + count > 4168 ? 2 : 0; };
  const auto refused = [](bool good, int otherwise) { return good ? otherwise : 3; };
  switch (pdu[0]) {
    case 3:
    case 4:
      if (size != 5) return 3;
      return refused(word(3) >= 1 && word(3) <= 0x7D, address(word(1), word(3)));
    case 6: return size == 5 ? address(word(1), 1) : 3;
    case 22: return size == 7 ? address(word(1), 1) : 3;
    case 16:
      if (size < 6 || size != 6u + pdu[5]) return 3;
      return refused(word(3) >= 1 && word(3) <= 0x7B && pdu[5] == 2 * word(3), address(word(1), word(3)));
    case 23:
      if (size < 10 || size != 10u + pdu[9]) return 3;
      return refused(
          word(3) >= 1 && word(3) <= 0x7D && word(7) >= 1 && word(7) <= 0x79 && pdu[9] == 2 * word(7),
          std::max(address(word(1), word(3)), address(word(5), word(7))));
    default: return 1;
  }
}

struct Sweep {
  std::uint8_t pdu[modbus::kMaxPdu] = {};
  std::size_t requests = 0;
  std::vector<std::uint16_t> words = std::vector<std::uint16_t>(4168);
  RegisterRange range{0, words};
  RegisterMap map{std::span(&range, 1)};

  void put(std::size_t at, std::size_t word) {
    pdu[at] = static_cast<std::uint8_t>(word >> 8);
    pdu[at + 1] = static_cast<std::uint8_t>(word);
  }
  void check(std::size_t size) {
    ++requests;
    if (static_cast<int>(modbus::check({pdu, size}, map, nullptr).exception) != exception_of(pdu, size))
      FAIL("function " << int{pdu[0]} << " of " << size << " bytes");
  }
};

/// Both sides of each limit of a quantity, and values whose bytes are swapped or cut.
constexpr std::size_t kQuantities[] = {0,   1,   2,   120, 121, 122,    123,    124,
                                       125, 126, 127, 255, 256, 0x0100, 0x0101, 0xFFFF};
constexpr std::size_t kAddresses[] = {0,    1,    4042, 4043, 4044, 4045,  4046,
                                      4047, 4048, 4166, 4167, 4168, 0xFFFF};

TEST_CASE("Modbus: FC 16 of every length, quantity up to 130 and byte count") {
  Sweep sweep;
  sweep.pdu[0] = 16;
  for (std::size_t size = 1; size <= modbus::kMaxPdu; ++size)
    for (std::size_t quantity = 0; quantity <= 130; ++quantity)
      for (unsigned count = 0; count < 256; ++count) {
        sweep.put(3, quantity);
        sweep.pdu[5] = static_cast<std::uint8_t>(count);
        sweep.check(size);
      }
  CHECK(sweep.requests == 253 * 131 * 256);
}

TEST_CASE("Modbus: FC 23 of every length and byte count, with quantities on both sides of their limits") {
  Sweep sweep;
  sweep.pdu[0] = 23;
  for (const std::size_t reads : kQuantities)
    for (const std::size_t writes : kQuantities)
      for (std::size_t size = 1; size <= modbus::kMaxPdu; ++size)
        for (const std::size_t count : {size - 11, size - 10, size - 9, 2 * writes, std::size_t{0}}) {
          sweep.put(3, reads);
          sweep.put(7, writes);
          sweep.pdu[9] = static_cast<std::uint8_t>(count);
          sweep.check(size);
        }
}

TEST_CASE("Modbus: every function code of every length, each address with each quantity") {
  Sweep sweep;
  for (unsigned function = 0; function < 256; ++function) {
    if (function == 43) continue;  // identification has tests of its own
    sweep.pdu[0] = static_cast<std::uint8_t>(function);
    for (std::size_t size = 1; size <= modbus::kMaxPdu; ++size)
      sweep.check(size);
    for (const std::size_t address : kAddresses)
      for (const std::size_t quantity : kQuantities) {
        sweep.put(1, address);
        sweep.put(3, quantity);
        sweep.pdu[5] = static_cast<std::uint8_t>(2 * quantity);
        for (const std::size_t size : {std::size_t{5}, std::size_t{7}, 6 + 2 * quantity})
          if (size <= modbus::kMaxPdu) sweep.check(size);
      }
  }
}

TEST_CASE("Modbus: FC 23 with each pair of addresses") {
  Sweep sweep;
  sweep.pdu[0] = 23;
  for (const std::size_t reads_from : kAddresses)
    for (const std::size_t writes_to : kAddresses)
      for (const std::size_t reads : {1u, 2u, 121u, 125u})
        for (const std::size_t writes : {1u, 2u, 121u}) {
          sweep.put(1, reads_from);
          sweep.put(3, reads);
          sweep.put(5, writes_to);
          sweep.put(7, writes);
          sweep.pdu[9] = static_cast<std::uint8_t>(2 * writes);
          sweep.check(10 + 2 * writes);
        }
}

}  // namespace
}  // namespace cbcan::io
