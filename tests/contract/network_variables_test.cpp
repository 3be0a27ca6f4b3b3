// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "Process data: network variables": the objects that are views of the registers.

#include "contract/pdo.hpp"

using namespace cbcan::contract;

namespace {

constexpr std::size_t kBytes = 128;

using Bytes = std::vector<std::uint8_t>;

/// Byte 2k is the low byte and byte 2k+1 the high byte of word k; an odd last byte is a low byte.
Words words_in(const Bytes& bytes) {
  Words words((bytes.size() + 1) / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i)
    words[i / 2] = static_cast<std::uint16_t>(words[i / 2] | bytes[i] << 8 * (i % 2));
  return words;
}

/// `count` bytes that differ from each other: first, first + 1, ...
Bytes counting(std::size_t first, std::size_t count) {
  Bytes bytes(count);
  for (std::size_t i = 0; i < count; ++i)
    bytes[i] = static_cast<std::uint8_t>(first + i);
  return bytes;
}

/// Writes the inputs by SDO, as UNSIGNED64.
void fill_inputs(Window& window, const Bytes& bytes) {
  for (std::uint16_t sub = 1; sub <= 16; ++sub) {
    const auto element = bytes.begin() + 8 * (sub - 1);
    window.configure(0xA440, sub, 8, words_in({element, element + 8}));
  }
}

/// Sub-index 0 is the count; the last sub-index exists, and the next does not.
void check_count(Window& window, std::uint16_t index, std::uint16_t count) {
  CHECK(read_local(window, index, 0) == Value{count, 1});
  check_missing(window, index, static_cast<std::uint16_t>(count + 1), kNoSubIndex);
}

/// A value written to an input is in its registers and nowhere else, and can be read.
void check_input(Window& window, std::uint16_t index, std::uint16_t sub, std::size_t size) {
  INFO("sub-index " << sub);
  const std::size_t place = (sub - 1u) * size;
  Bytes image = counting(1, kBytes);
  fill_inputs(window, image);
  CHECK(local_bytes(window, index, sub) == hex_of(counting(place + 1, size)));
  const Bytes value = counting(0xA1, size);
  window.configure(index, sub, static_cast<std::uint16_t>(size), words_in(value));
  std::copy(value.begin(), value.end(), image.begin() + static_cast<std::ptrdiff_t>(place));
  CHECK(inputs(window) == words_in(image));
  CHECK(local_bytes(window, index, sub) == hex_of(value));
}

/// A value that the PLC has written to the registers of an output can be read.
void check_output(Window& window, std::uint16_t index, std::uint16_t sub, std::size_t size) {
  INFO("sub-index " << sub);
  const std::size_t place = (sub - 1u) * size;
  window.set(kOutputs, words_in(counting(1, kBytes)));
  CHECK(local_bytes(window, index, sub) == hex_of(counting(place + 1, size)));
  Bytes image(kBytes);
  const Bytes value = counting(0xA1, size);
  std::copy(value.begin(), value.end(), image.begin() + static_cast<std::ptrdiff_t>(place));
  window.set(kOutputs, words_in(image));
  CHECK(local_bytes(window, index, sub) == hex_of(value));
}

/// In PDOs, RPDO 1 and TPDO 1.
void check_pdos(Window& window, std::uint16_t input, std::uint16_t output, std::uint16_t sub,
                std::size_t size) {
  const std::uint32_t place = sub * 0x100u + static_cast<std::uint32_t>(8 * size);
  set_up_pdo(window, 0x1400, 0x27F, 255, {input * 0x10000u + place});
  set_up_pdo(window, 0x1800, 0x1FF, 255, {output * 0x10000u + place});
  Bytes image(kBytes);
  fill_inputs(window, image);
  window.set(kOutputs, Words(64));
  start_own_node(window).expect("1FF#" + hex_of(Bytes(size)));
  const Bytes value = counting(0xA1, size);
  std::copy(value.begin(), value.end(), image.begin() + static_cast<std::ptrdiff_t>((sub - 1u) * size));
  window.arrive("27F#" + hex_of(value));
  CHECK(inputs(window) == words_in(image));
  window.set(kOutputs, words_in(image));
  window.expect("1FF#" + hex_of(value));
}

/// A row of the table of types; `size` in bytes.
void check_row(std::uint16_t input, std::uint16_t output, std::size_t size) {
  INFO(std::hex << input);
  Window window;
  const auto count = static_cast<std::uint16_t>(kBytes / size);
  for (const std::uint16_t index : Words{input, output})
    check_count(window, index, count);
  for (const std::uint16_t sub : Words{1, 2, count}) {
    check_input(window, input, sub, size);
    check_output(window, output, sub, size);
  }
  check_pdos(window, input, output, count, size);
}

}  // namespace

TEST_CASE("[PDO-4] [PDO-5] [PDO-7] [PDO-8] [PDO-9] [PDO-10] [PDO-11] [PDO-12] [PDO-13] INTEGER8 to REAL32") {
  check_row(0xA000, 0xA480, 1);
  check_row(0xA040, 0xA4C0, 1);
  check_row(0xA0C0, 0xA540, 2);
  check_row(0xA100, 0xA580, 2);
  check_row(0xA140, 0xA5C0, 3);
  check_row(0xA180, 0xA600, 3);
  check_row(0xA1C0, 0xA640, 4);
  check_row(0xA200, 0xA680, 4);
  check_row(0xA240, 0xA6C0, 4);
}

TEST_CASE("[PDO-14] [PDO-15] [PDO-16] [PDO-17] [PDO-18] [PDO-19] [PDO-20] [PDO-21] INTEGER40 to UNSIGNED64") {
  check_row(0xA280, 0xA700, 5);
  check_row(0xA2C0, 0xA740, 5);
  check_row(0xA300, 0xA780, 6);
  check_row(0xA340, 0xA7C0, 6);
  check_row(0xA380, 0xA800, 7);
  check_row(0xA3C0, 0xA840, 7);
  check_row(0xA400, 0xA880, 8);
  check_row(0xA440, 0xA8C0, 8);
}

TEST_CASE("[PDO-2] low byte first") {
  Window window;
  window.configure(0xA040, 1, 1, {0x11});
  window.configure(0xA040, 2, 1, {0x22});
  window.configure(0xA040, 128, 1, {0x33});
  CHECK(inputs(window) == registers_with({{0, 0x2211}, {63, 0x3300}}));
  window.set(kOutputs, registers_with({{0, 0x4433}, {63, 0x6655}}));
  CHECK(local_bytes(window, 0xA4C0, 1) == "33");
  CHECK(local_bytes(window, 0xA4C0, 2) == "44");
  CHECK(local_bytes(window, 0xA4C0, 127) == "55");
  CHECK(local_bytes(window, 0xA4C0, 128) == "66");
}

TEST_CASE("[PDO-22] sub-indices") {
  Window window;
  window.set(kOutputs, words_in(counting(1, kBytes)));
  for (std::uint16_t sub = 1; sub <= 42; ++sub)  // the last two bytes are no element
    CHECK(local_bytes(window, 0xA600, sub) == hex_of(counting(3u * sub - 2u, 3)));
  CHECK(read_local(window, 0xA600, 0) == Value{42, 1});
  check_missing(window, 0xA600, 43, kNoSubIndex);
  for (std::uint16_t sub = 1; sub <= 25; ++sub)
    window.configure(0xA280, sub, 5, words_in(counting(5u * sub - 4u, 5)));
  Bytes image = counting(1, kBytes);
  std::fill_n(image.begin() + 125, 3, std::uint8_t{0});
  CHECK(inputs(window) == words_in(image));
  CHECK(read_local(window, 0xA280, 0) == Value{25, 1});
  check_read_only(window, 0xA280, 0);
}

TEST_CASE("[PDO-6] [PDO-23] BOOLEANs are bits") {
  Window window;
  struct Row {
    std::uint16_t index, count;
    unsigned first_place, last_place;  ///< registers of the first and of the last
    std::uint16_t first, last;         ///< their bits
  };
  for (const Row& row : {Row{0xA080, 254, 0, 15, 0x0001, 0x2000}, Row{0xA081, 254, 15, 31, 0x4000, 0x0800},
                         Row{0xA082, 254, 31, 47, 0x1000, 0x0200}, Row{0xA083, 254, 47, 63, 0x0400, 0x0080},
                         Row{0xA084, 8, 63, 63, 0x0100, 0x8000}}) {
    INFO(std::hex << row.index);
    check_count(window, row.index, row.count);
    window.configure(row.index, 1, 1, {1});
    CHECK(inputs(window) == registers_with({{row.first_place, row.first}}));
    window.configure(row.index, 1, 1, {0});
    window.configure(row.index, row.count, 1, {1});
    CHECK(inputs(window) == registers_with({{row.last_place, row.last}}));
    window.configure(row.index, row.count, 1, {0});
    const auto output = static_cast<std::uint16_t>(row.index + 0x480);
    check_count(window, output, row.count);
    window.set(kOutputs, registers_with({{row.first_place, row.first}}));
    check_locals(window, {{output, 1, {1, 1}}, {output, 2, {0, 1}}});
    window.set(kOutputs, registers_with({{row.last_place, row.last}}));
    CHECK(read_local(window, output, row.count) == Value{1, 1});
    CHECK(read_local(window, output, static_cast<std::uint16_t>(row.count - 1)) == Value{0, 1});
  }
  for (const std::uint16_t index : Words{0xA085, 0xA505})
    check_missing(window, index, 0, kNoObject);
}

TEST_CASE("[PDO-23] in PDOs, where each is one bit") {
  Window window;
  set_up_pdo(window, 0x1400, 0x27F, 255, {0xA0800201, 0xA0840801, 0xA0400208});
  set_up_pdo(window, 0x1800, 0x1FF, 255, {0xA5000201, 0xA4C00208, 0xA5040801});
  window.set(kOutputs, registers_with({{0, 0x00FD}, {63, 0x7FFF}}));
  for (const std::uint16_t sub : Words{1, 4})
    window.configure(0xA080, sub, 1, {1});
  start_own_node(window).expect("1FF#0000");
  window.arrive("27F#0B02");  // 1, 1, 82h
  CHECK(inputs(window) == registers_with({{0, 0x820B}, {63, 0x8000}}));
  window.arrive("27F#0400");  // 0, 0, 01h
  CHECK(inputs(window) == registers_with({{0, 0x0109}}));
  window.set(kOutputs, registers_with({{0, 0x82FF}})).expect("1FF#0501");  // 1, 82h, 0
  window.set(kOutputs + 63, {0x8000}).expect("1FF#0503");
}

TEST_CASE("[PDO-24] views of the same registers") {
  Window window;
  const Bytes value{0x00, 0x00, 0x80, 0x3F, 0x05, 0x86, 0x07, 0xF8};  // 3F800000h is 1.0
  struct Row {
    std::uint16_t index, sub;
    const char* seen;
  };
  const Row rows[] = {{0xA000, 8, "F8"},
                      {0xA040, 3, "80"},
                      {0xA080, 24, "01"},
                      {0xA080, 23, "00"},
                      {0xA0C0, 4, "07F8"},
                      {0xA100, 2, "803F"},
                      {0xA140, 1, "000080"},
                      {0xA180, 2, "3F0586"},
                      {0xA1C0, 2, "058607F8"},
                      {0xA200, 1, "0000803F"},
                      {0xA240, 1, "0000803F"},
                      {0xA280, 1, "0000803F05"},
                      {0xA2C0, 1, "0000803F05"},
                      {0xA300, 1, "0000803F0586"},
                      {0xA340, 1, "0000803F0586"},
                      {0xA380, 1, "0000803F058607"},
                      {0xA3C0, 1, "0000803F058607"},
                      {0xA400, 1, "0000803F058607F8"},
                      {0xA440, 1, "0000803F058607F8"}};
  window.configure(0xA440, 1, 8, words_in(value));
  window.set(kOutputs, words_in(value));
  for (const Row& row : rows) {
    INFO(std::hex << row.index);
    CHECK(local_bytes(window, row.index, row.sub) == row.seen);
    CHECK(local_bytes(window, static_cast<std::uint16_t>(row.index + 0x480), row.sub) == row.seen);
  }
  window.arrive("67F#2300A20111223344").expect("5FF#6000A20100000000");  // another node's SDO writes A200h:01
  CHECK(window.target().read(kInputs, 4) == Words{0x2211, 0x4433, 0x8605, 0xF807});
  window.arrive("67F#40C0A40500000000").expect("5FF#4FC0A40505000000");
}
