// SPDX-License-Identifier: MIT
#include "devices/transducer.hpp"

#include "tests/devices/rig.hpp"

namespace cbcan::test {

namespace {

using Sensor = Rig<devices::Transducer>;

}  // namespace

TEST_CASE("the unit of a process value is that of 6131h, unless 6132h scales it") {
  Sensor sensor(demo_image("pressure_transducer.eds"));
  const auto unit = [&] { return sensor.device.points().front().unit; };
  CHECK(unit() == "Pa");
  sensor.write(0x6131, 1, 0x004E0000);
  CHECK(unit() == "bar");
  sensor.write(0x6131, 1, 0x034E0000);  // kilobar
  CHECK(unit() == "");
  sensor.write(0x6131, 1, 0x00220000);
  sensor.write(0x6132, 1, 2).expect("changed 9130:01");
  CHECK(unit() == "");
}

TEST_CASE("a new pressure shows in 9130h, and every change is an event") {
  Sensor sensor(demo_image("pressure_transducer.eds"));
  sensor.shows(0x9130, 1, 101325);
  sensor.input(0x9130, 1, 99021.4).expect("changed 9130:01").shows(0x9130, 1, 99021);
  sensor.input(0x9130, 1, 99021.3);
  sensor.input(0x9130, 1, -2).expect("changed 9130:01").shows(0x9130, 1, 0xFFFFFFFE);
  CHECK(sensor.deadline == kNever);
}

TEST_CASE("6132h: decimal digits") {
  Sensor sensor(demo_image("pressure_transducer.eds"), {{0x9130, 1, 1250}, {0x6132, 1, 2}});
  sensor.shows(0x9130, 1, 1250);  // 12.5
  sensor.input(0x9130, 1, 12.345).expect("changed 9130:01").shows(0x9130, 1, 1235);
  sensor.write(0x6132, 1, 0).expect("changed 9130:01").shows(0x9130, 1, 12);
}

TEST_CASE("6150h tells of overload") {
  Sensor sensor(demo_image("pressure_transducer.eds"));
  sensor.shows(0x6150, 1, 0);
  sensor.input(0x9130, 1, 2147483648.0).shows(0x9130, 1, 0x7FFFFFFF).shows(0x6150, 1, 0x02);
  sensor.expect("changed 9130:01");
  sensor.input(0x9130, 1, -2147483649.0).shows(0x9130, 1, 0x80000000).shows(0x6150, 1, 0x04);
  sensor.expect("changed 9130:01");
  sensor.input(0x9130, 1, 2147483647.0).expect("changed 9130:01").shows(0x6150, 1, 0);
}

TEST_CASE("a sensor break: EMCY, not valid, and the value stays") {
  Sensor sensor(demo_image("pressure_transducer.eds"));
  REQUIRE(sensor.device.incidents().size() == 1);
  CHECK(sensor.device.incidents()[0] == "sensor-break");
  sensor.incident("sensor-break", true).expect("5000/01");
  sensor.input(0x9130, 1, 5).shows(0x9130, 1, 101325).shows(0x6150, 1, 0x01);
  sensor.reset(true).expect("5000/01").shows(0x6150, 1, 0x01);
  sensor.incident("sensor-break", false).expect("5000 over", "changed 9130:01").shows(0x9130, 1, 5);
  sensor.shows(0x6150, 1, 0);
}

TEST_CASE("reset node leaves the world as it is, without an event") {
  Sensor sensor(demo_image("pressure_transducer.eds"));
  sensor.input(0x9130, 1, 7).expect("changed 9130:01");
  sensor.reset(true).shows(0x9130, 1, 7);
  sensor.reset(false).shows(0x9130, 1, 7);
}

TEST_CASE("the process value is in 6130h, 7130h and 9130h, as many of them as there are") {
  using enum DataType;
  Sensor sensor(dictionary_of({{0x6130, 2, kReal32},
                               {0x6132, 2, kUnsigned8},
                               {0x6150, 2, kUnsigned8},
                               {0x7130, 2, kInteger16},
                               {0x9130, 2, kInteger32}}),
                {{0x6132, 2, 2}});
  sensor.input(0x7130, 2, 12.5);
  sensor.shows(0x6130, 2, 0x41480000);  // 12.5
  sensor.shows(0x7130, 2, 1250).shows(0x9130, 2, 1250);
  sensor.shows(0x9130, 1, 0).expect("changed 6130:02", "changed 7130:02", "changed 9130:02");
  sensor.input(0x6130, 2, 400);  // 40,000 is too large for 7130h
  sensor.shows(0x7130, 2, 0x7FFF).shows(0x9130, 2, 40'000);
  sensor.shows(0x6150, 2, 0x02).expect("changed 6130:02", "changed 7130:02", "changed 9130:02");
}

TEST_CASE("a transducer with 7130h alone, or 6130h alone, begins with what the file says") {
  using enum DataType;
  Sensor narrow(dictionary_of({{0x6132, 1, kUnsigned8}, {0x7130, 1, kInteger16}}),
                {{0x6132, 1, 1}, {0x7130, 1, 250}});
  narrow.shows(0x7130, 1, 250);
  narrow.write(0x6132, 1, 0).expect("changed 7130:01").shows(0x7130, 1, 25);
  CHECK_FALSE(narrow.device.set_input(0x9130, 1, 1, 0));
  Sensor real(dictionary_of({{0x6130, 1, kReal32}}), {{0x6130, 1, 0x41480000}});
  real.shows(0x6130, 1, 0x41480000);
  real.input(0x6130, 1, -1e30).expect("changed 6130:01").shows(0x6130, 1, 0xF149F2CA);
}

TEST_CASE("a transducer has as many channels as its dictionary") {
  Sensor sensor(dictionary_of({{0x9130, 3, DataType::kInteger32}}));  // no digits, no status
  sensor.input(0x9130, 3, 33).shows(0x9130, 3, 33).shows(0x9130, 1, 0).expect("changed 9130:03");
  for (const auto sub : std::initializer_list<std::uint8_t>{0, 4, 255})
    CHECK_FALSE(sensor.device.set_input(0x9130, sub, 1, 0));
  CHECK_FALSE(sensor.device.set_input(0x6150, 1, 1, 0));
}

}  // namespace cbcan::test
