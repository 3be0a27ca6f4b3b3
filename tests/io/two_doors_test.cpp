// SPDX-License-Identifier: MIT
// One module with both windows in use at once, through both doors: Modbus TCP and the core's RTU server, on
// the same registers. One PLC scans blocks, the other one uses R3700; neither notices the other.

#include "cbcan/coprocessor/coprocessor.hpp"
#include "cbcan/modbus/rtu_server.hpp"
#include "modbus_fixture.hpp"
#include "support/modbus_crc.hpp"
#include "support/scanner_plc.hpp"

using namespace cbcan;
using namespace cbcan::io::test;
using cbcan::test::CountingNode;
using cbcan::test::kScannedNode;
using cbcan::test::ScannerPlc;

namespace {

using Words = std::vector<std::uint16_t>;

void append_word(Bytes& bytes, std::size_t word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

Bytes write_request(std::size_t first, std::span<const std::uint16_t> words) {
  Bytes pdu{0x10};
  append_word(pdu, first);
  append_word(pdu, words.size());
  pdu.push_back(static_cast<std::uint8_t>(2 * words.size()));
  for (const std::uint16_t word : words)
    append_word(pdu, word);
  return pdu;
}

Bytes read_request(std::size_t first, std::size_t count) {
  Bytes pdu{0x03};
  append_word(pdu, first);
  append_word(pdu, count);
  return pdu;
}

/// A way to the registers: a request's PDU for the response's.
using Door = std::function<Bytes(const Bytes&)>;

template <class Image>
void read(const Door& door, std::size_t first, Image& image) {
  const Bytes response = door(read_request(first, image.size()));
  REQUIRE(response.size() == 2 + 2 * image.size());
  for (std::size_t i = 0; i < image.size(); ++i)
    image[i] = static_cast<std::uint16_t>(response[2 + 2 * i] << 8 | response[3 + 2 * i]);
}

struct Module final : CanPort {
  Module() {
    coprocessor_.start(now_);
    server_.on_request = [this] {
      tell(server_.valid.back(), server_.written.back().first, server_.written.back().count);
    };
    poll();
  }

  bool try_send(const Frame& frame) override {
    if (frame.id == 0x600u + kScannedNode) node.on_request(frame.data);
    return true;
  }

  Bytes by_tcp(const Bytes& pdu) {
    Bytes frame{0, 1, 0, 0};
    append_word(frame, pdu.size() + 1);
    frame.push_back(1);
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    client_.send(frame);
    const std::size_t head = 7;
    const std::size_t size = head + (pdu[0] == 3 ? 2u + 2u * pdu[4] : 5u);
    server_.run_until([&] { return client_.has(size); });
    const Bytes response = client_.take();
    return {response.begin() + head, response.end()};
  }

  Bytes by_rtu(const Bytes& pdu) {
    Bytes frame{1};
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    const std::uint16_t crc = cbcan::test::modbus_crc(frame);
    frame.push_back(static_cast<std::uint8_t>(crc));
    frame.push_back(static_cast<std::uint8_t>(crc >> 8));
    pass(2 * kMillisecond);
    for (const std::uint8_t byte : frame)
      rtu_.on_byte(byte, static_cast<std::uint32_t>(now_));
    pass(2 * kMillisecond);
    REQUIRE(rtu_.poll(static_cast<std::uint32_t>(now_)) == 0);
    const auto response = rtu_.execute();
    const Bytes bytes(response.begin() + 1, response.end() - 2);
    rtu_.on_sent();
    tell(rtu_.executed().valid, rtu_.executed().first, rtu_.executed().count);
    return bytes;
  }

  void respond() {
    if (node.responses.empty()) return;
    coprocessor_.on_frame({.id = 0x580u + kScannedNode, .length = 8, .data = node.responses.front()}, now_);
    node.responses.pop_front();
    poll();
  }
  void pass(Time duration) {
    now_ += duration;
    poll();
  }

  CountingNode node;

 private:
  void tell(bool valid, std::size_t first, std::size_t count) {
    REQUIRE(valid);
    if (count != 0) coprocessor_.on_registers_written(first, count, now_);
    poll();
  }
  void poll() {
    while (coprocessor_.poll(now_) <= now_) {
    }
  }

  template <std::size_t kFirst, std::size_t kCount>
  std::span<std::uint16_t, kCount> registers() {
    return std::span<std::uint16_t>(server_.registers).subspan<kFirst, kCount>();
  }

  Server server_;
  Client client_{server_};
  std::array<RegisterRange, 1> ranges_{{{0, server_.registers}}};
  RegisterMap map_{ranges_};
  RtuServer rtu_{{&map_, 1}, {}};
  Time now_ = 1'000'000;
  Coprocessor coprocessor_{RegisterWindow(registers<regmap::kWindowFirst, regmap::kWindowWords>()),
                           registers<regmap::kProcessFirst, regmap::kProcessWords>(),
                           *this,
                           {},
                           {registers<regmap::kScannerOutFirst, regmap::kScannerOutWords>(),
                            registers<regmap::kScannerInFirst, regmap::kScannerInWords>()}};
};

/// A PLC that writes when something changes: four bytes, another object each time.
struct FlagPlc {
  void step(const Door& door) {
    constexpr std::uint16_t kIndex = 0x5000;
    if (!busy_) {
      const Words request{0xCA0E,
                          5055,
                          kScannedNode,
                          static_cast<std::uint16_t>(kIndex + done / 256),
                          static_cast<std::uint16_t>(done % 256),
                          4};
      door(write_request(regmap::kWindowFirst, request));
      busy_ = true;
      return;
    }
    std::array<std::uint16_t, 8> image{};
    read(door, regmap::kWindowFirst, image);
    if (image[0] == 0xCA0E) return;
    busy_ = false;
    const std::uint32_t own = cbcan::test::scanned_value(static_cast<std::uint16_t>(kIndex + done / 256),
                                                         static_cast<std::uint8_t>(done));
    if (image[0] == 0 && image[5] == 4 && (image[6] | std::uint32_t{image[7]} << 16) == own) ++right;
    ++done;
  }

  unsigned done = 0;
  unsigned right = 0;

 private:
  bool busy_ = false;
};

}  // namespace

TEST_CASE("both windows and both doors at once: each request is one transfer, each result its own") {
  constexpr unsigned kRequests = 1000;
  Module module;
  const Door tcp = [&](const Bytes& pdu) { return module.by_tcp(pdu); };
  const Door rtu = [&](const Bytes& pdu) { return module.by_rtu(pdu); };
  const bool scans_by_tcp = GENERATE(true, false);
  const Door& scanned = scans_by_tcp ? tcp : rtu;
  const Door& flagged = scans_by_tcp ? rtu : tcp;
  ScannerPlc plc(1'000'000);
  FlagPlc other;
  std::mt19937 random(1);
  for (unsigned i = 0; i < 100 * kRequests && (plc.ended <= kRequests || other.done < kRequests); ++i) {
    switch (random() % 6) {
      case 0: plc.scan(); break;
      case 1: scanned(write_request(regmap::kScannerOutFirst, plc.out)); break;
      case 2: read(scanned, regmap::kScannerInFirst, plc.in); break;
      case 3: other.step(flagged); break;
      default: module.respond(); break;
    }
  }
  CHECK(plc.ended > kRequests);
  CHECK(other.done >= kRequests);
  CHECK(other.right == other.done);
  CHECK(plc.results.at(5) == 1);
  CHECK(plc.results.at(0) == plc.ended - 1);
  CHECK(module.node.transfers - (plc.done.size() + other.done) <= 2);  // the next ones may have gone out
  plc.check(module.node);
}
