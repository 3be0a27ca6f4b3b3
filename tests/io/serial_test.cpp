// SPDX-License-Identifier: MIT
// Modbus RTU on a serial line, here a pseudo-terminal.

#include "io/serial/serial_port.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include "io/modbus/modbus_rtu.hpp"
#include "io/modbus_fixture.hpp"
#include "io/temporary_folder.hpp"
#include "support/complaint.hpp"
#include "support/modbus_crc.hpp"

namespace cbcan::io::test {
namespace {

struct Place : TemporaryFolder {
  std::string link() const { return file("line"); }
  StreamAddress address() const { return {link(), {}, true}; }
};

std::string complaint_of(const window::Line& settings) {
  return cbcan::test::complaint_of<std::exception>([&] { open_serial("rtu", settings); });
}

std::string complaint_of(const StreamAddress& address) {
  return cbcan::test::complaint_of<std::exception>([&] { PseudoTerminal("slcan", address); });
}

termios line_of(int port) {
  termios line{};
  REQUIRE(tcgetattr(port, &line) == 0);
  return line;
}

/// Appends the CRC.
std::string frame(std::string_view text) {
  const Bytes bytes = cbcan::test::with_crc(hex(text));
  return {bytes.begin(), bytes.end()};
}

TEST_CASE("serial: bit rates and frames of a character") {
  const Place place;
  const PseudoTerminal terminal("x", place.address());
  struct Rate {
    int baud;
    speed_t speed;
  };
  for (const Rate& rate :
       {Rate{1200, B1200}, Rate{2400, B2400}, Rate{4800, B4800}, Rate{9600, B9600}, Rate{19'200, B19200},
        Rate{38'400, B38400}, Rate{57'600, B57600}, Rate{115'200, B115200}}) {
    const Descriptor port = open_serial("rtu", {place.link(), rate.baud, 'N'});
    const termios line = line_of(port.get());
    CHECK(cfgetospeed(&line) == rate.speed);
    CHECK(cfgetispeed(&line) == rate.speed);
    CHECK((line.c_cflag & CSTOPB) != 0);  // 8N2
    CHECK((line.c_cflag & (PARODD | CRTSCTS)) == 0);
    CHECK((line.c_cflag & (CLOCAL | CREAD)) == (CLOCAL | CREAD));
    CHECK((line.c_lflag & (ICANON | ECHO | ISIG)) == 0);
    CHECK((line.c_iflag & INPCK) == 0);
  }
  for (const char parity : {'E', 'O'}) {
    const Descriptor port = open_serial("rtu", {place.link(), 9600, parity});
    const termios line = line_of(port.get());
    CHECK((line.c_cflag & CSTOPB) == 0);
    CHECK((line.c_iflag & INPCK) != 0);
    CHECK(((line.c_cflag & PARODD) != 0) == (parity == 'O'));
  }
}

TEST_CASE("serial: a port that cannot be opened is reported with a way out") {
  const Place place;
  CHECK(complaint_of({"/dev/none", 9601, 'E'}) ==
        "rtu /dev/none: 9601 baud: must be 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, "
        "460800, "
        "921600");
  CHECK(complaint_of({place.link(), 9600, 'E'}) ==
        "rtu " + place.link() + ": no such device: plug the adapter in, or write another path");
  CHECK(complaint_of({"/dev/null", 9600, 'E'}) ==
        "rtu /dev/null: no serial port; write the path of one, such as /dev/ttyUSB0");
  const PseudoTerminal terminal("x", place.address());
  const Descriptor port = open_serial("rtu", {place.link(), 9600, 'E'});
  CHECK(complaint_of({place.link(), 9600, 'E'}) ==
        "rtu " + place.link() + ": another program uses it; stop that one, or write another path");
  CHECK(complaint_of({place.name, 9600, 'E'}) == "rtu " + place.name + ": Is a directory");
}

TEST_CASE("pseudo-terminal: a link of its own, which goes with it") {
  const Place place;
  {
    const PseudoTerminal terminal("slcan", place.address());
    CHECK(std::filesystem::is_symlink(place.link()));
    CHECK((fcntl(terminal.port.get(), F_GETFL) & O_NONBLOCK) != 0);
    const Descriptor other(::open(place.link().c_str(), O_RDWR | O_NOCTTY));
    CHECK((line_of(other.get()).c_lflag & (ICANON | ECHO)) == 0);
    REQUIRE(::write(other.get(), "\r\n", 2) == 2);
    std::array<char, 8> heard{};
    CHECK(::read(terminal.port.get(), heard.data(), heard.size()) == 2);
    CHECK(std::string(heard.data()) == "\r\n");
  }
  CHECK_FALSE(std::filesystem::is_symlink(place.link()));
}

TEST_CASE("pseudo-terminal: a link that was left behind is replaced, nothing else is") {
  const Place place;
  REQUIRE(symlink("/dev/pts/999999", place.link().c_str()) == 0);
  { const PseudoTerminal terminal("slcan", place.address()); }
  const std::string in_use = "slcan pty:" + place.link() +
                             ": in use: another program serves there, or it is a file; write another path";
  const auto told = [&] { return complaint_of(place.address()); };
  REQUIRE(symlink("/nowhere/at/all", place.link().c_str()) == 0);
  CHECK(told() == in_use);
  unlink(place.link().c_str());
  {
    const PseudoTerminal terminal("slcan", place.address());
    CHECK(told() == in_use);
  }
  const Descriptor file(::open(place.link().c_str(), O_CREAT | O_WRONLY, 0600));
  CHECK(told() == in_use);
  CHECK(complaint_of(StreamAddress{"/nowhere/line", {}, true}) ==
        "slcan pty:/nowhere/line: No such file or directory; write a path in a folder that can be written");
}

struct Line {
  Line() { open(); }
  void open() { terminal.emplace("x", place.address()); }
  void turn() {
    modbus->poll(Reactor::now());
    reactor.poll(0);
  }
  void say(const std::string& text) {
    REQUIRE(::write(terminal->port.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }
  std::string heard(std::size_t size) {
    std::string text;
    turn_until([this] { turn(); },
               [&] {
                 std::array<char, 512> some;
                 const ssize_t count = ::read(terminal->port.get(), some.data(), some.size());
                 if (count > 0) text.append(some.data(), static_cast<std::size_t>(count));
                 return text.size() >= size;
               });
    return text;
  }

  Place place;
  std::optional<PseudoTerminal> terminal;
  Reactor reactor;
  std::vector<std::string> warnings;
  std::size_t requests = 0;
  Unit first{[this](bool, const modbus::Range&) { ++requests; }};
  Unit second{[this](bool, const modbus::Range&) { ++requests; }};
  std::optional<ModbusSerial> modbus;
};

TEST_CASE("serial: requests to the stations of two networks, and to all of them") {
  Line line;
  line.modbus.emplace(line.reactor, std::vector<protocols::ModbusUnit*>{&line.first, &line.second},
                      window::Line{line.place.link(), 115'200, 'N'}, 5,
                      [&](const std::string& text) { line.warnings.push_back(text); });
  CHECK(line.modbus->device() == line.place.link());
  CHECK(line.modbus->next_deadline() == kNever);
  line.turn();
  CHECK(line.modbus->next_deadline() == kNever);
  line.say(frame("05 06 0001 1234"));
  CHECK(line.heard(8) == frame("05 06 0001 1234"));
  CHECK(line.first.words[1] == 0x1234);
  line.second.words[2] = 0x4321;
  line.say(frame("06 03 0002 0001"));
  CHECK(line.heard(7) == frame("06 03 02 4321"));
  line.say(frame("06 03 FFFF 0001"));
  CHECK(line.heard(5) == frame("06 83 02"));
  line.say(frame("00 06 0009 0777"));
  turn_until([&] { line.turn(); }, [&] { return line.second.words[9] == 0x0777; });
  CHECK(line.first.words[9] == 0x0777);
  CHECK(line.requests == 5);
  CHECK(line.warnings.empty());
}

TEST_CASE("serial: a lost line is reported, and opened again later") {
  Line line;
  line.modbus.emplace(line.reactor, std::vector<protocols::ModbusUnit*>{&line.first},
                      window::Line{line.place.link(), 115'200, 'N'}, 1,
                      [&](const std::string& text) { line.warnings.push_back(text); });
  line.terminal.reset();
  const auto turn = [&] {
    errno = EAGAIN;  // from an earlier call: the end of a line sets none
    line.turn();
  };
  turn_until(turn, [&] { return line.warnings.size() == 1; });
  CHECK(line.warnings[0] ==
        "rtu " + line.place.link() + ": is gone; plug it in again, it is looked for every second");
  const Time lost = Reactor::now(), due = line.modbus->next_deadline();
  CHECK(due <= lost + kSecond);
  CHECK(due > lost);
  line.modbus->poll(due);
  CHECK(line.modbus->next_deadline() == due + kSecond);
  line.open();
  line.modbus->poll(due + kSecond - 1);
  CHECK(line.warnings.size() == 1);
  line.modbus->poll(due + kSecond);
  REQUIRE(line.warnings.size() == 2);
  CHECK(line.warnings[1] == "rtu " + line.place.link() + ": is there again");
  line.say(frame("01 06 0001 1234"));
  CHECK(line.heard(8) == frame("01 06 0001 1234"));
}

struct Listening final : cbcan::test::RegisterUnit {
  Listening() : RegisterUnit(std::vector<std::uint16_t>(10)) {}
  modbus::Pdu handle(const protocols::ModbusRequest& request, Room room) override {
    requests.emplace_back(request.pdu.begin(), request.pdu.end());
    units.push_back(request.unit);
    return RegisterUnit::handle(request, room);
  }
  std::vector<Bytes> requests;
  std::vector<unsigned> units;
};

TEST_CASE("RTU over TCP: the unit gets requests without station and CRC") {
  Listening unit;
  const auto session = protocols::rtu_over_tcp({&unit}, Reactor::now, 7)();
  session->receive(frame("07 06 0001 1234"));
  session->receive(frame("07 03 0010 0001"));
  session->receive(frame("00 06 0002 0001"));
  CHECK(session->unsent() == frame("07 06 0001 1234") + frame("07 83 02"));
  session->sent(8);
  CHECK(session->unsent() == frame("07 83 02"));
  CHECK(unit.requests == std::vector<Bytes>{hex("06 0001 1234"), hex("03 0010 0001"), hex("06 0002 0001")});
  CHECK(unit.units == std::vector<unsigned>{7, 7, 0});
}

}  // namespace
}  // namespace cbcan::io::test
