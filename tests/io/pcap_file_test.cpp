// SPDX-License-Identifier: MIT
// Expected bytes by hand from draft-ietf-opsawg-pcapng, RFC 791 and RFC 9293.

#include "io/files/captures.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include "io/bytes.hpp"
#include "io/temporary_folder.hpp"

namespace cbcan::io {
namespace {

struct Pcap {
  void open(std::size_t networks, std::uint64_t most = 0, Time wall_offset = 0) {
    file.emplace(
        journal, PcapFile::Settings{path(), most, networks, wall_offset},
        [](base::Buffer& to, const journal::Event& event) {
          if (event.kind == journal::Kind::kCommand)
            base::append(to, "said ", event.code);
          else if (event.sub != 0)
            base::append(to, "sub");
        },
        [this](const std::string& line) { warnings.push_back(line); });
  }
  void hear(const Frame& frame, Time at, std::uint8_t network = 1) {
    journal.add({.network = network, .at = at, .frame = frame});
  }
  void say(std::uint32_t code) { journal.add({.kind = journal::Kind::kCommand, .code = code}); }
  /// What has been added since the last call.
  io::test::Bytes added() {
    file->poll();
    const io::test::Bytes all = bytes(path());
    const io::test::Bytes news(all.begin() + static_cast<std::ptrdiff_t>(seen), all.end());
    seen = all.size();
    return news;
  }
  static io::test::Bytes bytes(const std::string& path) {
    const std::string all = io::test::text_of(path);
    return {all.begin(), all.end()};
  }
  std::string path() const { return folder.file("bus.pcapng"); }

  io::test::TemporaryFolder folder;
  journal::Journal journal;
  std::optional<PcapFile> file;
  std::vector<std::string> warnings;
  std::size_t seen = 0;
};

using io::test::hex;

const std::string kSection = "0A0D0D0A 1C000000 4D3C2B1A 0100 0000 FFFFFFFFFFFFFFFF 1C000000";
const std::string kModbus =
    "01000000 24000000 6500 0000 00000000 0200 0600 6D6F64627573 0000 00000000 24000000";

std::string can(char digit) {
  return std::string("01000000 20000000 E300 0000 00000000 0200 0400 63616E3") + digit + " 00000000 20000000";
}

/// 080#, at this microsecond.
std::string sync(const std::string& time) {
  return "06000000 28000000 00000000 00000000" + time + "08000000 08000000 00000080 00 000000 28000000";
}

TEST_CASE("pcap: the section, an interface for each network, and one for Modbus") {
  Pcap pcap;
  pcap.open(2);
  CHECK(pcap.added() == hex(kSection + can('1') + can('2') + kModbus));
  CHECK(pcap.added().empty());
}

TEST_CASE("pcap: frames, with the wall clock's time") {
  Pcap pcap;
  pcap.open(2, 0, Time{1} << 32);
  pcap.added();
  pcap.hear({0x605, 2, 0, {0xAA, 0x55}}, 1'500'000);
  CHECK(pcap.added() == hex("06000000 2C000000 00000000 01000000 60E31600 0A000000 0A000000"
                            "00000605 02 000000 AA55 0000 2C000000"));
  pcap.hear({0x701, 1, Frame::kRemote, {}}, 0, 2);
  CHECK(pcap.added() == hex("06000000 28000000 01000000 01000000 00000000 08000000 08000000"
                            "40000701 01 000000 28000000"));
  pcap.hear({0x1ABCDEF0, 1, Frame::kExtended, {7}}, 2);
  CHECK(pcap.added() == hex("06000000 2C000000 00000000 01000000 02000000 09000000 09000000"
                            "9ABCDEF0 01 000000 07 000000 2C000000"));
}

TEST_CASE("pcap: what is said goes with the next packet") {
  Pcap pcap;
  pcap.open(1);
  pcap.added();
  pcap.say(1);
  pcap.say(2);
  CHECK(pcap.added().empty());
  pcap.journal.add({.sub = 1, .frame = {0x080, 0, 0, {}}});
  CHECK(pcap.added() ==
        hex("06000000 44000000 00000000 00000000 00000000 08000000 08000000 00000080 00 000000"
            "0100 1100 7361696420310A 7361696420320A 737562 000000 00000000 44000000"));
  pcap.hear({0x080, 0, 0, {}}, 5);
  CHECK(pcap.added() == hex(sync("05000000")));
}

TEST_CASE("pcap: comments without a packet do not grow without limit") {
  Pcap pcap;
  pcap.open(1);
  pcap.added();
  for (std::uint32_t i = 0; i < 2000; ++i)
    pcap.say(10);
  pcap.hear({0x080, 0, 0, {}}, 0);
  // 1024 times "said 10\n" reaches 8192 characters.
  const io::test::Bytes packet = pcap.added();
  REQUIRE(packet.size() > 44);
  CHECK((packet[38] | packet[39] << 8) == 8192);
}

TEST_CASE("pcap: a request and its response, in made-up headers that count on") {
  Pcap pcap;
  pcap.open(1);
  pcap.added();
  const auto exchange = [&] {
    const journal::Event event{.kind = journal::Kind::kModbus,
                               .node = 9,   // unit ID
                               .sub = 1,    // a comment, for the request only
                               .index = 5,  // bytes of the request
                               .result = 0x1234,
                               .code = 3};  // the client
    const io::test::Bytes pdus = hex("03 0E74 0001  03 02 0007");
    pcap.journal.add(event, {pdus});
    return pcap.added();
  };
  const auto both = [](const char* sent, const char* answered, const char* acknowledged) {
    return hex(std::string("06000000 60000000 01000000 00000000 00000000 34000000 34000000"
                           "4500 0034 0000 4000 4006 25C4 0A000003 0AFFFFFE"
                           "C003 01F6") +
               sent + acknowledged + "5018 FFFF 0000 0000 1234 0000 0006 09 03 0E74 0001" +
               "0100 0300 737562 00 00000000 60000000" +
               "06000000 54000000 01000000 00000000 00000000 33000000 33000000"
               "4500 0033 0000 4000 4006 25C5 0AFFFFFE 0A000003"
               "01F6 C003" +
               acknowledged + answered + "5018 FFFF 0000 0000 1234 0000 0005 09 03 02 0007 00 54000000");
  };
  CHECK(exchange() == both("00000001", "0000000D", "00000001"));
  CHECK(exchange() == both("0000000D", "00000019", "0000000C"));
  pcap.journal.add({.kind = journal::Kind::kClient, .code = 3});
  CHECK(exchange() == both("00000001", "0000000D", "00000001"));
}

TEST_CASE("pcap: bytes that others have overwritten are reported as missing") {
  Pcap pcap;
  pcap.open(1);
  pcap.added();
  pcap.journal.add({.kind = journal::Kind::kModbus, .code = 3});
  CHECK(pcap.added().empty());
  REQUIRE(pcap.warnings.size() == 1);
  CHECK(pcap.warnings[0] == "pcap " + pcap.path() + ": 1 packets are missing: they were not read in time");
}

TEST_CASE("pcap: a file that is full becomes path.1") {
  Pcap pcap;
  pcap.open(1, 28 + 32 + 36 + 80);  // the head and two SYNCs
  for (Time at = 1; at <= 3; ++at)
    pcap.hear({0x080, 0, 0, {}}, at);
  pcap.file->poll();
  const std::string head = kSection + can('1') + kModbus;
  CHECK(Pcap::bytes(pcap.path() + ".1") == hex(head + sync("01000000") + sync("02000000")));
  CHECK(Pcap::bytes(pcap.path()) == hex(head + sync("03000000")));
  pcap.hear({0x080, 0, 0, {}}, 4);
  pcap.hear({0x080, 0, 0, {}}, 5);
  pcap.file->poll();
  CHECK(Pcap::bytes(pcap.path() + ".1") == hex(head + sync("03000000") + sync("04000000")));
  CHECK(pcap.warnings.empty());
}

TEST_CASE("pcap: where path.1 cannot be, the file is started again in its place") {
  Pcap pcap;
  REQUIRE(mkdir((pcap.path() + ".1").c_str(), 0700) == 0);
  pcap.open(1, 28 + 32 + 36 + 40);
  pcap.hear({0x080, 0, 0, {}}, 1);
  pcap.hear({0x080, 0, 0, {}}, 2);
  pcap.file->poll();
  CHECK(Pcap::bytes(pcap.path()) == hex(kSection + can('1') + kModbus + sync("02000000")));
  REQUIRE(pcap.warnings.size() == 1);
  CHECK(pcap.warnings[0].ends_with("; it begins again in the same place"));
}

TEST_CASE("pcap: where no new file can be begun, it ends and says so") {
  Pcap pcap;
  pcap.open(1, 28 + 32 + 36 + 40);
  pcap.hear({0x080, 0, 0, {}}, 1);
  pcap.file->poll();
  std::filesystem::remove_all(pcap.folder.name);
  for (int i = 0; i < 3; ++i) {
    pcap.hear({0x080, 0, 0, {}}, 2);
    pcap.file->poll();
  }
  REQUIRE(pcap.warnings.size() == 2);
  CHECK(pcap.warnings[1] == "pcap " + pcap.path() +
                                ": No such file or directory; it ends here, the simulation goes on; make "
                                "room, or write it to another disk");
}

TEST_CASE("pcap: a disk that is full ends the file, and says so once") {
  Pcap pcap;
  REQUIRE(symlink("/dev/full", pcap.path().c_str()) == 0);
  pcap.open(1);
  for (int i = 0; i < 3; ++i) {
    pcap.hear({0x080, 0, 0, {}}, 1);
    pcap.file->poll();
  }
  CHECK(pcap.file->next_deadline() == kNever);
  pcap.file.reset();
  REQUIRE(pcap.warnings.size() == 1);
  CHECK(pcap.warnings[0] == "pcap " + pcap.path() +
                                ": No space left on device; it ends here, the simulation goes on; make room, "
                                "or write it to another disk");
}

}  // namespace
}  // namespace cbcan::io
