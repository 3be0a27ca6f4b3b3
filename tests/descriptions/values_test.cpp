// SPDX-License-Identifier: MIT
#include "descriptions/values.hpp"

#include "support/catch.hpp"

namespace cbcan::tests {

namespace {

constexpr std::uint8_t kNode = 0x05;

std::optional<std::uint64_t> bits_of(std::string_view text, DataType type) {
  const auto number = descriptions::parse_number(text, kNode);
  return number ? descriptions::to_bits(*number, type) : std::nullopt;
}

}  // namespace

TEST_CASE("Integers are decimal, hexadecimal or octal") {
  CHECK(bits_of("258", DataType::kUnsigned16) == 258);
  CHECK(bits_of("0x1aF", DataType::kUnsigned16) == 0x1AF);
  CHECK(bits_of("0777", DataType::kUnsigned16) == 511);
  CHECK(bits_of("0", DataType::kUnsigned16) == 0);
  CHECK(bits_of("08", DataType::kUnsigned16) == 8);
  CHECK(descriptions::parse_number("08", kNode)->no_octal);
  CHECK_FALSE(descriptions::parse_number("07", kNode)->no_octal);
  CHECK(bits_of("18446744073709551615", DataType::kUnsigned64) == ~std::uint64_t{0});
}

TEST_CASE("What is no integer is not taken for one") {
  for (const char* text : {"", " ", "-", "+", "0x", "x", "1F", "1 2", "--1", "-$NODEID", "1+", "+1", "0x-1",
                           "18446744073709551616", "$NODEID$NODEID", "L", "-+1", "1.0"}) {
    INFO(text);
    CHECK_FALSE(descriptions::parse_number(text, kNode));
  }
}

TEST_CASE("$NODEID is added in any case and order") {
  CHECK(bits_of("$NODEID+0x80", DataType::kUnsigned32) == 0x85);
  CHECK(bits_of("$nodeid + 0x200", DataType::kUnsigned32) == 0x205);
  CHECK(bits_of("0x180+ $NodeID", DataType::kUnsigned32) == 0x185);
  CHECK(bits_of("$NODEID", DataType::kUnsigned8) == 5);
  CHECK(descriptions::parse_number("$NODEID", kNode)->node_ids == 1);
  CHECK(descriptions::parse_number("0x80 + $NODEID+$nodeid", kNode)->node_ids == 2);
  CHECK(descriptions::parse_number("5", kNode)->node_ids == 0);
}

TEST_CASE("An integer has to fit its type") {
  CHECK(bits_of("255", DataType::kUnsigned8) == 255);
  CHECK_FALSE(bits_of("256", DataType::kUnsigned8));
  CHECK_FALSE(bits_of("-1", DataType::kUnsigned8));
  CHECK(bits_of("-0", DataType::kUnsigned8) == 0);
  CHECK(bits_of("127", DataType::kInteger8) == 0x7F);
  CHECK_FALSE(bits_of("128", DataType::kInteger8));
  CHECK(bits_of("-128", DataType::kInteger8) == 0x80);
  CHECK_FALSE(bits_of("-129", DataType::kInteger8));
  CHECK(bits_of("-1", DataType::kInteger24) == 0xFFFFFF);
  CHECK(bits_of("-9223372036854775808", DataType::kInteger64) == 0x8000000000000000);
  CHECK_FALSE(bits_of("-9223372036854775809", DataType::kInteger64));
  CHECK(bits_of("0xFFFFFFFFFF", DataType::kUnsigned40) == 0xFFFFFFFFFF);
  CHECK_FALSE(bits_of("0x10000000000", DataType::kUnsigned40));
  CHECK(bits_of("1", DataType::kBoolean) == 1);
  CHECK_FALSE(bits_of("2", DataType::kBoolean));
}

TEST_CASE("Hexadecimal may be a two's complement, decimal may not") {
  CHECK(bits_of("0x80", DataType::kInteger8) == 0x80);
  CHECK(bits_of("0xFF", DataType::kInteger8) == 0xFF);
  CHECK_FALSE(bits_of("0x100", DataType::kInteger8));
  CHECK(bits_of("0xFFFFFF80", DataType::kInteger8) == 0x80);
  CHECK(bits_of("0xFFFFFFFFFFFFFF80", DataType::kInteger8) == 0x80);
  CHECK_FALSE(bits_of("0xFFFFFF7F", DataType::kInteger8));
  CHECK(bits_of("0xFFFF8000", DataType::kInteger40) == 0xFFFF8000);
  CHECK_FALSE(bits_of("255", DataType::kInteger8));
  CHECK(descriptions::from_bits(0x80, DataType::kInteger8) == -128);
  CHECK(descriptions::from_bits(0x80, DataType::kUnsigned8) == 128);
  CHECK(descriptions::from_bits(0xFFFFFF, DataType::kInteger24) == -1);
}

TEST_CASE("REAL is decimal text or a bit pattern") {
  CHECK(descriptions::parse_real("1.5", DataType::kReal32) == 0x3FC00000);
  CHECK(descriptions::parse_real("+1.5", DataType::kReal32) == 0x3FC00000);
  CHECK(descriptions::parse_real("-2", DataType::kReal64) == 0xC000000000000000);
  CHECK(descriptions::parse_real("0x3FC00000", DataType::kReal32) == 0x3FC00000);
  CHECK_FALSE(descriptions::parse_real("0x100000000", DataType::kReal32));
  CHECK_FALSE(descriptions::parse_real("1e39", DataType::kReal32));
  CHECK(descriptions::parse_real("1e39", DataType::kReal64));
  for (const char* text : {"", "+", "1,5", "1.5x", "e", "0x"}) {
    INFO(text);
    CHECK_FALSE(descriptions::parse_real(text, DataType::kReal32));
  }
}

TEST_CASE("Octets are pairs of digits") {
  CHECK(descriptions::parse_octets("01aBfF") == std::vector<std::uint8_t>{0x01, 0xAB, 0xFF});
  CHECK(descriptions::parse_octets(" 01 aB\tfF ") == std::vector<std::uint8_t>{0x01, 0xAB, 0xFF});
  CHECK(descriptions::parse_octets("0x0102") == std::vector<std::uint8_t>{0x01, 0x02});
  CHECK(descriptions::parse_octets("0") == std::vector<std::uint8_t>{});
  CHECK_FALSE(descriptions::parse_octets("012"));
  CHECK_FALSE(descriptions::parse_octets("0 12"));
  CHECK_FALSE(descriptions::parse_octets("zz"));
}

TEST_CASE("Bytes are little-endian") {
  CHECK(descriptions::to_bytes(0x12345678, 4) == std::vector<std::uint8_t>{0x78, 0x56, 0x34, 0x12});
  CHECK(descriptions::to_bytes(0x123456, 3) == std::vector<std::uint8_t>{0x56, 0x34, 0x12});
  CHECK(descriptions::to_utf16("\xFC\x80") == std::vector<std::uint8_t>{0xFC, 0x00, 0x80, 0x00});
}

TEST_CASE("Types are known by their index") {
  CHECK(descriptions::is_known(0x05));
  CHECK(descriptions::is_known(0x1B));
  for (const unsigned index : {0x00U, 0x0EU, 0x17U, 0x1CU, 0x20U, 0x100U})
    CHECK_FALSE(descriptions::is_known(index));
  CHECK(descriptions::name_of(DataType::kUnsigned40) == "UNSIGNED40");
  CHECK(descriptions::name_of(DataType::kInteger24) == "INTEGER24");
}

}  // namespace cbcan::tests
