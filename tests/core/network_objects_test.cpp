// SPDX-License-Identifier: MIT
// The manager's objects as bytes, and by SDO.

#include "core/manager_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

std::vector<std::uint8_t> found(const NetworkObjects& objects, std::uint16_t index, std::uint8_t sub) {
  const auto bytes = objects.find(index, sub);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

TEST_CASE("an image is a concise DCF with the objects of each node together, and a check sum") {
  NetworkObjects objects;
  // 1F80h = 1, 1F81h:05 = 5, 1F86h:05 = 191h, 1F81h:06 = 1
  const std::vector<std::uint8_t> image{4,    0,    0,    0,    0x80, 0x1F, 0, 4,    0, 0,    0,   1,    0,
                                        0,    0,    0x81, 0x1F, 5,    4,    0, 0,    0, 5,    0,   0,    0,
                                        0x86, 0x1F, 5,    4,    0,    0,    0, 0x91, 1, 0,    0,   0x81, 0x1F,
                                        6,    4,    0,    0,    0,    1,    0, 0,    0, 0x8C, 0xC9};
  REQUIRE(objects.use(std::span<const std::uint8_t>(image)));
  CHECK(objects.number(0x1F80, 0) == 1);
  CHECK(objects.number(0x1F86, 5) == 0x191);
  CHECK(objects.number(0x1F81, 6) == 1);
  CHECK(objects.find(0x1F86, 6).empty());
  CHECK(objects.find(0x1F81, 7).empty());
  CHECK(objects.write(0x1F81, 6, {}) == AbortCode::kReadOnly);

  SECTION("cut at any byte it is refused, and nothing is set") {
    for (std::size_t size = 0; size != image.size(); ++size) {
      CHECK_FALSE(objects.use(std::span(image).first(size)));
      CHECK(objects.number(0x1F80, 0) == 0);
    }
  }
  SECTION("objects of a node in two places") {
    const Bytes apart = image_of(concise({{0x1F81, 5, u32(5)}, {0x1F81, 6, u32(5)}, {0x1F86, 5, u32(5)}}));
    CHECK_FALSE(objects.use(std::span<const std::uint8_t>(apart)));
  }
  SECTION("an object of no node after them") {
    const Bytes late = image_of(concise({{0x1F81, 5, u32(5)}, {0x1F80, 0, u32(1)}}));
    CHECK_FALSE(objects.use(std::span<const std::uint8_t>(late)));
  }
  SECTION("with one bit changed it is refused, in RAM too") {
    for (std::size_t bit = 0; bit != 8 * image.size(); ++bit) {
      Bytes other = image;
      other[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
      CHECK_FALSE(objects.use(std::span<const std::uint8_t>(other)));
      CHECK_FALSE(objects.use(std::span(other), other.size()));
    }
  }
  SECTION("it may be the first bytes of a part of the flash") {
    Bytes part = image;
    part.resize(0x20000, 0xFF);
    CHECK(objects.use(std::span<const std::uint8_t>(part)));
    CHECK(objects.number(0x1F81, 6) == 1);
    CHECK_FALSE(objects.use(std::span<const std::uint8_t>(part).subspan(image.size())));  // erased
  }
}

TEST_CASE("an image with values of another length than their objects have is refused") {
  NetworkObjects objects;
  for (const Item& item : {Item{0x1F80, 0, {1}}, Item{0x1F81, 5, {5}}, Item{0x1F88, 5, Bytes(8)},
                           Item{0x1F8A, 5, u32(1)}, Item{0x300B, 0, u32(1)}, Item{0x300A, 1, {5}},
                           Item{0x300A, 1, {5, 0, 1}}, Item{0x300A, 1, Bytes(2 + 4 * 65)}}) {
    INFO(std::hex << item.index << " " << item.value.size());
    CHECK_FALSE(objects.use(std::span<const std::uint8_t>(image_of(concise({item})))));
  }
  CHECK(objects.use(std::span<const std::uint8_t>(image_of(concise({{0x300A, 1, Bytes(2 + 4 * 64)}})))));
  // A PDO has 64 bits: 32 and 32 are one, 33 and 32 none, and 255, 255, 255 and 3 are not 0.
  const auto mapping = [](std::initializer_list<std::uint8_t> lengths) {
    Bytes value{5, 0};
    for (const std::uint8_t bits : lengths)
      value.insert(value.end(), {bits, 1, 0, 0x60});
    return image_of(concise({{0x300A, 1, value}}));
  };
  CHECK(objects.use(std::span<const std::uint8_t>(mapping({32, 32}))));
  CHECK_FALSE(objects.use(std::span<const std::uint8_t>(mapping({33, 32}))));
  CHECK_FALSE(objects.use(std::span<const std::uint8_t>(mapping({255, 255, 255, 3}))));
}

TEST_CASE("objects in RAM are added, replaced and removed") {
  NetworkObjects objects;
  std::array<std::uint8_t, 4 + 3 * 11> memory{};
  REQUIRE(objects.use(std::span(memory), 0));
  const auto write = [&](std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    return objects.write(index, sub, u32(value));
  };
  CHECK(write(0x1F81, 127, 5) == AbortCode::kNone);
  CHECK(write(0x1F80, 0, 1) == AbortCode::kNone);
  CHECK(write(0x1F88, 127, 0xFFFFFFFF) == AbortCode::kNone);
  CHECK(write(0x1F89, 0, 1) == AbortCode::kStore);
  CHECK(write(0x1F80, 0, 3) == AbortCode::kNone);
  CHECK((objects.number(0x1F80, 0) == 3 && objects.number(0x1F81, 127) == 5 &&
         objects.number(0x1F88, 127) == 0xFFFFFFFF));
  CHECK(write(0x1F81, 127, 0) == AbortCode::kNone);
  CHECK(objects.find(0x1F81, 127).empty());
  CHECK(objects.write(0x1F8A, 1, Bytes{1}) == AbortCode::kNone);
  CHECK(found(objects, 0x1F8A, 1) == Bytes{1});
  CHECK(objects.write(0x1F22, 1, Bytes{1}) == AbortCode::kValue);  // no number of objects
  CHECK(objects.number(0x1F88, 127) == 0xFFFFFFFF);
  CHECK(memory[0] == 3);
}

TEST_CASE("the network by SDO") {
  ManagerRig rig({});
  rig.expect("77F#00");
  const auto put = [&](std::uint16_t index, std::uint16_t sub, std::uint16_t size,
                       std::initializer_list<std::uint16_t> value) {
    rig.write(0, index, sub, size, value);
    return rig.reg(3700) == 0 ? 0u : rig.reg(3706) | std::uint32_t{rig.reg(3707)} << 16;
  };
  CHECK(put(0x1F81, 5, 4, {0x0205, 0x0101}) == 0);  // retry factor and guard time
  CHECK(put(0x1F81, 5, 4, {5, 0}) == 0);
  CHECK(put(0x1F22, 5, 13, {1, 0, 0x1017, 0x0200, 0, 0xE800, 3}) == 0);
  CHECK(put(0x1F22, 5, 13, {2, 0, 0x1017, 0x0200, 0, 0xE800, 3}) == 0x06090030);
  CHECK(put(0x1F25, 5, 4, {0x6F63, 0x666E}) == 0x08000022);  // not active
  rig.request({5055, 0, 0x1F22, 5, 128});
  CHECK((rig.reg(3705) == 13 && rig.reg(3708) == 0x1017));
  CHECK(put(0x1F80, 0, 4, {1, 0}) == 0);
  rig.expect("000#8200");
  CHECK(put(0x1F81, 6, 4, {5, 0}) == 0x08000022);  // active
  rig.arrive("705#00").expect("605#4000100000000000");
  rig.arrive("585#4300100000000000").expect("605#2B171000E8030000");
  rig.arrive("585#6017100000000000").expect("000#0105");
  SECTION("conf: again") {
    CHECK(put(0x1F25, 5, 4, {0x6F63, 0x666F}) == 0x08000020);
    CHECK(put(0x1F25, 6, 4, {0x6F63, 0x666E}) == 0x08000022);
    CHECK(put(0x1F25, GENERATE(std::uint16_t{5}, std::uint16_t{128}), 4, {0x6F63, 0x666E}) == 0);
    rig.expect("605#4000100000000000");
  }
  SECTION("without bit 0 of 1F80h nothing is managed") {
    CHECK(put(0x1F80, 0, 4, {0, 0}) == 0);
    rig.arrive("705#00").pass(5 * kSecond).expect_silence();
    CHECK(rig.of(5) == 0x007F);
    CHECK(put(0x1F81, 6, 4, {5, 0}) == 0);
  }
}
