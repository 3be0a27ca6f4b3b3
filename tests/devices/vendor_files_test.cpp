// SPDX-License-Identifier: MIT
// Drives from EDS files with the usual defects of vendor files: missing values, limits of 0, wrong device types.
// Each must move with the program that moves the real drive. The files here are written by hand; none is from a
// vendor.
#include "tests/devices/vendor_plant.hpp"

namespace cbcan::test {

namespace {

struct Shape {
  const char* name;
  std::vector<Line> changes;
};

const std::vector<Shape> kShapes{
    {"no value anywhere", {}},
    {"limits and modes of 0", {{"607F", "7", "rw", "0"}, {"6080", "7", "rw", "0"}, {"6502", "7", "ro", "0"}}},
    {"no limits, no modes, no profile velocity",
     {{"607F", "-", "", ""}, {"6080", "-", "", ""}, {"6502", "-", "", ""}, {"6081", "-", "", ""}}},
    {"a mode without type", {{"6060", "", "rw", ""}, {"6061", "", "ro", ""}}},
    {"an unsigned mode", {{"6060", "5", "rw", "0"}}},
    {"a device type of 0", {{"1000", "7", "ro", "0"}}},
    {"a device type with its bytes reversed", {{"1000", "7", "ro", "0x92010200"}}},
    {"no device type", {{"1000", "-", "", ""}}},
};

}  // namespace

TEST_CASE("A drive from a vendor's file moves to a position, and at a velocity") {
  for (const Shape& shape : kShapes) {
    INFO(shape.name);
    Plant plant(file_with(shape.changes));
    plant.move_to("F4010000");
    CHECK(plant.get(0x6064) == 500);
    CHECK(plant.get(0x6061) == 1);

    Plant other(file_with(shape.changes));
    other.enable("03");
    other.write("FF6000", "C8000000", "23");
    other.bench.pass(10 * kSecond);
    CHECK(other.get(0x606C) == 200);
    CHECK(other.get(0x6064) == 2000);
  }
}

namespace {

/// Units and limits as vendors give them, and the results of moves.
struct Maker {
  const char* name;
  std::string objects;
  std::vector<Line> changes;
  int velocity;    ///< demanded in mode 3
  int after_10_s;  ///< position, user units; accelerations of 0 mean without a ramp
  int increments;  ///< 6063h of a move to 1000
};

const std::vector<Maker> kMakers{
    {"velocities in 1/min, increments, no resolution",
     number_of("60A8", "0x00B50000") + number_of("60A9", "0x00B44700"),
     {{"6080", "7", "rw", "50000"}, {"607F", "7", "rw", "50000"}},
     3000,
     1'000'000,
     1000},
    {"increments, though the feed is 1",
     pair_of("608F", "2000", "1") + pair_of("6092", "1", "1") + number_of("60A8", "0x00B50000") +
         number_of("60A9", "0x00B50300"),
     {{"6080", "7", "rw", "200000"}},
     200'000,
     2'000'000,
     1000},
    {"tenths of degrees and 1/min",
     pair_of("608F", "36000", "1") + pair_of("6092", "1", "1") + number_of("60A8", "0xFF410000") +
         number_of("60A9", "0x00B44700"),
     {},
     300,
     180'000,
     10'000},
    {"factors of 1",
     pair_of("608F", "2048", "1") + pair_of("6093", "1", "1") + pair_of("6096", "1", "1"),
     {},
     200'000,
     2'000'000,
     1000},
    {"a motor speed, and no resolution",
     pair_of("6096", "1", "1"),
     {{"6080", "7", "rw", "2500"}},
     100,
     1000,
     1000},
    {"a motor speed, and a resolution of 1",
     pair_of("608F", "1", "1"),
     {{"6080", "7", "rw", "2500"}},
     100,
     1000,
     1000},
};

}  // namespace

TEST_CASE("A drive with a maker's units and limits moves as far as they say") {
  for (const Maker& maker : kMakers) {
    INFO(maker.name);
    Plant plant(file_with(maker.changes) + maker.objects + text_of({"6063", "4", "ro", ""}));
    char bytes[16];
    std::snprintf(bytes, sizeof bytes, "%02X%02X%02X00", maker.velocity & 0xFF, maker.velocity >> 8 & 0xFF,
                  maker.velocity >> 16);
    plant.enable("03");
    plant.write("FF6000", bytes, "23");
    plant.bench.pass(10 * kSecond);
    CHECK(plant.get(0x606C) == maker.velocity);
    CHECK(plant.get(0x6064) == maker.after_10_s);
    CHECK((plant.get(0x6041) & 0x0C00) == 0x0400);

    Plant other(file_with(maker.changes) + maker.objects + text_of({"6063", "4", "ro", ""}));
    other.move_to("E8030000");
    CHECK(other.get(0x6064) == 1000);
    CHECK(other.get(0x6063) == maker.increments);
  }
}

namespace {

/// An encoder of 36,000 increments behind a gear of 2 : 1, so a revolution of the shaft is 72,000.
struct Unit {
  std::string objects;
  double increments;  ///< of a unit of position; of a unit of velocity in a second
};

const std::vector<Unit> kPositionUnits{
    {number_of("60A8", "0x00B50000"), 1},
    {number_of("60A8", "0xFEB40000"), 720},
    {number_of("60A8", "0xFF410000"), 20},
    {text_of({"6089", "2", "rw", "-1"}) + text_of({"608A", "5", "rw", "0x41"}), 20},
    {pair_of("6093", "3", "1"), 3},
    {pair_of("6092", "100", "1"), 720},
};
const std::vector<Unit> kVelocityUnits{
    {number_of("60A9", "0x00B50300"), 1},
    {number_of("60A9", "0x00B44700"), 1200},
    {number_of("60A9", "0x01B44800"), 200},
    {number_of("60A9", "0xFF410300"), 20},
    {text_of({"608B", "2", "rw", "-1"}) + text_of({"608C", "5", "rw", "0xA4"}), 120},
    {text_of({"608B", "2", "rw", "0"}) + text_of({"608C", "5", "rw", "0xAC"}), 1},
    {pair_of("6094", "7", "1"), 7},
};

}  // namespace

TEST_CASE("Position and velocity agree, whatever units the file has for the one and for the other") {
  for (const Unit& place : kPositionUnits)
    for (const Unit& speed : kVelocityUnits) {
      INFO(place.objects << speed.objects);
      Plant plant(file_with({}) + pair_of("608F", "36000", "1") + pair_of("6091", "2", "1") + place.objects +
                  speed.objects + text_of({"6063", "4", "ro", ""}));
      plant.enable("03");
      plant.write("FF6000", "E8030000", "23");
      plant.bench.pass(6 * kSecond);
      CHECK(plant.get(0x606C) == 1000);
      CHECK(plant.get(0x6063) == 6000 * speed.increments);
      CHECK(plant.get(0x6064) == std::lround(6000 * speed.increments / place.increments));
    }
}

TEST_CASE("A drive whose file sets its brake moves when operation is enabled") {
  Plant plant(file_with({{"6502", "7", "ro", "0x63"}}) + pair_of("60FE", "1", "0xF0001"));
  plant.move_to("F4010000");
  CHECK(plant.get(0x6064) == 500);
  CHECK((plant.get(0x6041) & 0x0400) == 0x0400);
}

TEST_CASE("What a file leaves out is the profile's default, and a master reads it, after each reset") {
  Plant plant(file_with({{"6067", "7", "rw", "0"}}));
  for (const char* reset : {"000#8105", "000#8205"}) {
    plant.bench.ask(reset, "705#00");
    CHECK(plant.get(0x6502) == 0x3AD);  // neither 6042h nor 60C1h
    CHECK(plant.get(0x605A) == 2);
    CHECK(plant.get(0x6007) == 1);
    CHECK(plant.get(0x6065) == -1);  // no window
    CHECK(plant.get(0x6067) == 0);   // as the file says
  }
}

}  // namespace cbcan::test
