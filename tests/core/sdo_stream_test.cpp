// SPDX-License-Identifier: MIT
// Streamed downloads: what the application gets, when the response comes, and that it hears of each that ends
// early. 31C3h is the CRC of "123456789" (CiA 301, 7.2.4.3.16).

#include "cbcan/canopen/sdo/server.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

namespace {

constexpr std::uint16_t kStreamed =
    ObjectFlags::kWrite | ObjectFlags::kComputed | ObjectFlags::kStreamed | ObjectFlags::kChecked;
const std::vector<ObjectEntry> kEntries{
    {0x1F50, 1, 1, DataType::kDomain, 0, kStreamed, 0, 0},
    {0x2000, 0, 0, DataType::kUnsigned8, 0, ObjectFlags::kReadWrite, 0, 1}};

using Sent = std::deque<std::string>;
using Pieces = std::vector<std::string>;

struct StreamRig final : DownloadStream {
  explicit StreamRig(std::size_t room = 21) : buffer(room) {
    server.reset(0x5C2);
    CHECK(ask("21501F0109000000") == Sent{"5C2#80501F0105000405"});  // no application yet
    server.set_stream(*this);
  }
  AbortCode on_piece(const Piece& piece, Time) override {
    const AbortCode given =
        std::exchange(answer, answer == AbortCode::kLater ? AbortCode::kLater : AbortCode::kNone);
    if (given == AbortCode::kNone)
      taken.push_back(std::to_string(piece.offset) + " " +
                      std::string(piece.bytes.begin(), piece.bytes.end()) + (piece.last ? "." : ""));
    return given;
  }
  void on_aborted() override { ++aborted; }

  /// The responses to this request.
  std::deque<std::string> ask(const std::string& request) {
    server.on_frame(frame_from("642#" + request), now);
    return std::exchange(port.sent, {});
  }
  std::vector<std::string> pieces() { return std::exchange(taken, {}); }

  std::vector<std::uint8_t> values = std::vector<std::uint8_t>(1);
  std::vector<std::uint8_t> buffer;
  RecordingPort port;
  ObjectDictionary dictionary{kEntries, values, nullptr};
  SdoServer server{dictionary, port, buffer};
  AbortCode answer = AbortCode::kNone;  ///< to the next piece; kLater until it is changed
  std::vector<std::string> taken;
  int aborted = 0;
  Time now = 0;
};

}  // namespace

TEST_CASE("streamed download: expedited is one piece, also without a size") {
  StreamRig rig;
  CHECK(rig.ask("27501F0131323300") == Sent{"5C2#60501F0100000000"});
  CHECK(rig.pieces() == Pieces{"0 123."});
  CHECK(rig.ask("22501F0131323334") == Sent{"5C2#60501F0100000000"});
  CHECK(rig.pieces() == Pieces{"0 1234."});
  CHECK(rig.ask("2F00200005000000") == Sent{"5C2#6000200000000000"});
  CHECK(rig.dictionary.write(0x1F50, 1, rig.values, 0) == AbortCode::kIncompatible);
  CHECK(rig.ask("40501F0100000000") == Sent{"5C2#80501F0101000106"});  // write only
  CHECK(rig.aborted == 0);
}

TEST_CASE("streamed download: segments are pieces as large as the buffer has room for") {
  StreamRig rig(14);
  CHECK(rig.ask("21501F0111000000") == Sent{"5C2#60501F0100000000"});
  CHECK(rig.pieces() == Pieces{"0 "});
  CHECK(rig.ask("0041424344454647") == Sent{"5C2#2000000000000000"});
  CHECK(rig.pieces().empty());
  CHECK(rig.ask("1048494A4B4C4D4E") == Sent{"5C2#3000000000000000"});
  CHECK(rig.pieces() == Pieces{"0 ABCDEFGHIJKLMN"});
  CHECK(rig.ask("094F505100000000") == Sent{"5C2#2000000000000000"});
  CHECK(rig.pieces() == Pieces{"14 OPQ."});
  rig.ask("21501F0103000000");
  CHECK(rig.ask("0B31320000000000") == Sent{"5C2#80501F0110000706"});  // not as many as declared
  CHECK(rig.pieces() == Pieces{"0 "});
  CHECK(rig.aborted == 1);
}

TEST_CASE("streamed download: a sub-block is a piece, and the last segment waits for the CRC") {
  StreamRig rig;
  CHECK(rig.ask("C6501F0109000000") == Sent{"5C2#A4501F0103000000"});  // three segments fit
  CHECK(rig.ask("0131323334353637").empty());
  CHECK(rig.ask("8238390000000000") == Sent{"5C2#A202030000000000"});
  CHECK(rig.pieces() == Pieces{"0 ", "0 1234567"});
  SECTION("right") {
    CHECK(rig.ask("D5C3310000000000") == Sent{"5C2#A100000000000000"});
    CHECK(rig.pieces() == Pieces{"7 89."});
    CHECK(rig.aborted == 0);
    CHECK(rig.server.deadline() == kNever);
  }
  SECTION("wrong: it is no last piece") {
    CHECK(rig.ask("D5C3300000000000") == Sent{"5C2#80501F0104000405"});
    CHECK(rig.pieces().empty());
    CHECK(rig.aborted == 1);
  }
}

TEST_CASE("streamed download: sub-blocks, one of them with a segment lost") {
  StreamRig rig;
  rig.ask("C2501F0118000000");
  rig.ask("0141414141414141");
  rig.ask("0242424242424242");
  CHECK(rig.ask("0343434343434343") == Sent{"5C2#A203030000000000"});
  CHECK(rig.ask("0343434343434343").empty());  // repeated on the bus
  rig.ask("0144444444444444");
  CHECK(rig.ask("0346460000000000") == Sent{"5C2#A201030000000000"});
  CHECK(rig.pieces() == Pieces{"0 ", "0 AAAAAAABBBBBBBCCCCCCC", "21 DDDDDDD"});
  CHECK(rig.ask("8145000000000000") == Sent{"5C2#A201030000000000"});
  CHECK(rig.pieces().empty());                                         // its only segment is the last
  CHECK(rig.ask("D100000000000000") == Sent{"5C2#80501F0110000706"});  // 31 bytes
  CHECK(rig.aborted == 1);
}

TEST_CASE("streamed download: the response waits for the application") {
  StreamRig rig(14);
  const auto held = [&](const std::string& request) {
    rig.answer = AbortCode::kLater;
    CHECK(rig.ask(request).empty());
    rig.now = rig.server.deadline();
    CHECK(rig.server.waits());
    rig.server.poll(rig.now);
    CHECK(rig.port.sent.empty());
    rig.answer = AbortCode::kNone;
    rig.now = rig.server.deadline();
    rig.server.poll(rig.now);
    return std::exchange(rig.port.sent, {});
  };
  CHECK(held("C6501F010F000000") == Sent{"5C2#A4501F0102000000"});
  rig.ask("0131323334353637");
  CHECK(held("0238390000000000") == Sent{"5C2#A202020000000000"});
  CHECK(rig.ask("8141000000000000") == Sent{"5C2#A201020000000000"});
  rig.pieces();
  CHECK(rig.ask("D9DAEC0000000000") == Sent{"5C2#80501F0104000405"});
  CHECK(held("21501F0108000000") == Sent{"5C2#60501F0100000000"});
  rig.ask("0031323334353637");
  CHECK(held("1D38000000000000") == Sent{"5C2#3000000000000000"});
  CHECK(held("2F501F0138000000") == Sent{"5C2#60501F0100000000"});
  CHECK(rig.pieces() == Pieces{"0 ", "0 12345678.", "0 8."});
  SECTION("meanwhile a segment again is ignored, a new request is none of the old transfer") {
    rig.ask("21501F0107000000");
    rig.answer = AbortCode::kLater;
    rig.ask("0131323334353637");
    CHECK(rig.ask("0131323334353637").empty());
    CHECK(rig.aborted == 1);
    CHECK(rig.ask("4000200000000000") == Sent{"5C2#4F00200000000000"});
    CHECK(rig.aborted == 2);
    CHECK(rig.server.deadline() == kNever);
  }
  SECTION("and may refuse it then") {
    rig.answer = AbortCode::kLater;
    rig.ask("2F501F0138000000");
    rig.answer = AbortCode::kHardware;
    rig.server.poll(rig.now);
    CHECK(rig.port.sent == Sent{"5C2#80501F0100000606"});
    CHECK(rig.aborted == 2);
  }
}

TEST_CASE("streamed download: the application hears of each that ends early") {
  StreamRig rig;
  const auto* const begin = GENERATE("21501F0109000000", "C2501F0109000000");
  rig.ask(begin);
  SECTION("the client's abort") {
    CHECK(rig.ask("80501F0100000005").empty());
  }
  SECTION("its silence, also in segments") {
    CHECK(rig.server.deadline() == 1'000'001);
    rig.server.poll(1'000'001);
    CHECK(rig.port.sent == Sent{"5C2#80501F0100000405"});
  }
  SECTION("the node leaves the SDO states") {
    rig.server.reset(0x5C2);
  }
  SECTION("the application refuses a piece") {
    rig.answer = AbortCode::kHardware;
    for (const char* segment : {"0131323334353637", "0231323334353637", "0331323334353637"})
      rig.ask(*begin == '2' ? "80501F0100000005" : segment);
  }
  CHECK(rig.aborted == 1);
  CHECK(rig.server.deadline() == kNever);
}

}  // namespace cbcan::test
