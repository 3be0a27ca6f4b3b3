// SPDX-License-Identifier: MIT
#include "io/files/pcap_file.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "io/can/can_frames.hpp"

namespace cbcan::io {

namespace {

// Blocks and options, in the byte order of this machine.
constexpr std::uint32_t kSectionHeader = 0x0A0D0D0A;
constexpr std::uint32_t kByteOrder = 0x1A2B3C4D;
constexpr std::uint32_t kInterface = 1;
constexpr std::uint32_t kEnhancedPacket = 6;
constexpr std::uint16_t kComment = 1;
constexpr std::uint16_t kInterfaceName = 2;

constexpr std::uint16_t kLinkTypeRaw = 101;
constexpr std::uint16_t kLinkTypeCan = 227;

constexpr std::uint32_t kServer = 0x0AFFFFFE;
constexpr std::uint32_t kFirstClient = 0x0A000000;
constexpr std::uint16_t kModbusPort = 502;
constexpr std::uint32_t kFirstClientPort = 49152;
constexpr std::size_t kIpBytes = 20;
constexpr std::size_t kTcpBytes = 20;

/// Appends numbers in this machine's byte order.
template <class... Numbers>
void put(std::string& text, Numbers... numbers) {
  (text.append(reinterpret_cast<const char*>(&numbers), sizeof numbers), ...);
}

/// Appends numbers, high byte first.
template <class... Numbers>
void put_big(std::string& text, Numbers... numbers) {
  const auto one = [&text](auto number) {
    for (std::size_t byte = sizeof number; byte-- > 0;)
      text += static_cast<char>(number >> 8 * byte);
  };
  (one(numbers), ...);
}

void pad(std::string& text) {
  text.append((4 - text.size() % 4) % 4, '\0');
}

void put_option(std::string& body, std::uint16_t code, std::string_view value) {
  if (value.empty()) return;
  put(body, code, static_cast<std::uint16_t>(value.size()));
  body += value;
  pad(body);
}

std::string block(std::uint32_t type, std::string_view body) {
  std::string text;
  const auto size = static_cast<std::uint32_t>(body.size() + 12);
  put(text, type, size);
  text += body;
  put(text, size);
  return text;
}

std::string interface_block(std::uint16_t link_type, std::string_view name) {
  std::string body;
  put(body, link_type, std::uint16_t{0}, std::uint32_t{0});
  put_option(body, kInterfaceName, name);
  put(body, std::uint32_t{0});
  return block(kInterface, body);
}

/// RFC 1071; `header` has an even number of bytes.
std::uint16_t checksum(std::string_view header) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < header.size(); i += 2)
    sum += static_cast<std::uint8_t>(header[i]) * 256U + static_cast<std::uint8_t>(header[i + 1]);
  sum = (sum & 0xFFFF) + (sum >> 16);
  return static_cast<std::uint16_t>(~(sum + (sum >> 16)));
}

std::string ip_header(std::uint32_t from, std::uint32_t to, std::size_t size) {
  constexpr std::uint16_t kDoNotFragment = 0x4000;
  constexpr std::uint16_t kHopsAndTcp = 0x4006;
  const auto total = static_cast<std::uint16_t>(kIpBytes + size);
  const auto header = [&](std::uint16_t sum) {
    std::string text;
    put_big(text, std::uint16_t{0x4500}, total, std::uint16_t{0}, kDoNotFragment, kHopsAndTcp, sum, from, to);
    return text;
  };
  return header(checksum(header(0)));
}

}  // namespace

PcapFile::PcapFile(const journal::Journal& journal, Settings settings, Comment comment, Warn warn)
    : journal_(journal),
      settings_(std::move(settings)),
      where_("pcap " + settings_.path + ": "),
      comment_(std::move(comment)),
      warn_(std::move(warn)),
      output_(Output::open("pcap", settings_.path, settings_.most_waiting)),
      cursor_(journal) {
  if (!std::filesystem::is_regular_file(settings_.path)) settings_.most = 0;
  begin();
}

PcapFile::~PcapFile() {
  poll();
  if (ended_) return;
  output_.finish();
  warn_of_missing(warn_, where_, dropped_, "packets");
}

/// Writes the section header and the interfaces.
void PcapFile::begin() {
  std::string body;
  put(body, kByteOrder, std::uint16_t{1}, std::uint16_t{0}, ~std::uint64_t{0});
  std::string text = block(kSectionHeader, body);
  for (std::size_t network = 1; network <= settings_.networks; ++network)
    text += interface_block(kLinkTypeCan, fmt::format("can{}", network));
  text += interface_block(kLinkTypeRaw, "modbus");
  output_.add(text);
  written_ = text.size();
}

/// Pending output still goes to the old file.
void PcapFile::turn_over() {
  output_.finish();
  if (std::rename(settings_.path.c_str(), (settings_.path + ".1").c_str()) != 0)
    warn_(where_ + reason(errno) + "; it begins again in the same place");
  output_ = Output::open("pcap", settings_.path, settings_.most_waiting);
  begin();
}

void PcapFile::poll() {
  const std::uint64_t missed = cursor_.look([this](std::uint64_t /*number*/, const journal::Event& event) {
    if (!ended_) add(event);
    return true;
  });
  dropped_ += missed;
  if (ended_) return;
  if (const int error = output_.flush(); error != 0) {
    output_.take_rest();
    ended_ = true;
    return warn_(where_ + reason(error) +
                 "; it ends here, the simulation goes on; make room, or write it to another disk");
  }
  if (output_.waiting() == 0) warn_of_missing(warn_, where_, dropped_, "packets");
}

void PcapFile::add(const journal::Event& event) {
  const std::string comment = comment_(event);
  if (event.kind == journal::Kind::kFrame) return add_can(event, comment);
  if (event.kind == journal::Kind::kModbus && event.code != 0) return add_modbus(event, comment);
  if (event.kind == journal::Kind::kClient && event.state == 0) sent_.erase(event.code);
  constexpr std::size_t kMostPending = 8192;  // an option has 65,535 bytes at most
  if (!comment.empty() && pending_.size() < kMostPending) pending_ += comment + "\n";
}

/// As in SocketCAN, but the identifier is big-endian.
void PcapFile::add_can(const journal::Event& event, const std::string& comment) {
  const Frame& frame = event.frame;
  std::string data;
  put_big(data, to_kernel(frame).can_id, frame.length, std::uint8_t{0}, std::uint8_t{0}, std::uint8_t{0});
  const std::size_t size = (frame.flags & Frame::kRemote) != 0 ? 0 : frame.length;
  data.append(reinterpret_cast<const char*>(frame.data.data()), size);
  add_packet(event.network - 1U, event.at, data, comment);
}

void PcapFile::add_modbus(const journal::Event& event, const std::string& comment) {
  const Bytes all = journal_.bytes(event);
  if (all.empty()) return void(++dropped_);
  add_segment(event, true, all.first(event.index), comment);
  add_segment(event, false, all.subspan(event.index), "");
}

void PcapFile::add_segment(const journal::Event& event, bool is_request, Bytes pdu,
                           const std::string& comment) {
  constexpr std::size_t kHeader = 7;
  constexpr std::uint16_t kPushAcknowledge = 0x5018;
  Sent& sent = sent_[event.code];
  std::uint32_t& own = is_request ? sent.requests : sent.responses;
  const std::uint32_t other = is_request ? sent.responses : sent.requests;
  const std::uint32_t client = kFirstClient + (event.code & 0xFFFFFF);
  const auto port = static_cast<std::uint16_t>(kFirstClientPort + event.code % 16384);
  std::string data = ip_header(is_request ? client : kServer, is_request ? kServer : client,
                               kTcpBytes + kHeader + pdu.size());
  put_big(data, is_request ? port : kModbusPort, is_request ? kModbusPort : port, own, other,
          kPushAcknowledge, std::uint16_t{0xFFFF}, std::uint32_t{0});
  put_big(data, event.result, std::uint16_t{0}, static_cast<std::uint16_t>(1 + pdu.size()), event.node);
  data.append(reinterpret_cast<const char*>(pdu.data()), pdu.size());
  own += static_cast<std::uint32_t>(kHeader + pdu.size());
  add_packet(static_cast<std::uint32_t>(settings_.networks), event.at, data, comment);
}

void PcapFile::add_packet(std::uint32_t interface, Time at, std::string_view data,
                          const std::string& comment) {
  const Time time = at + settings_.wall_offset;
  const auto size = static_cast<std::uint32_t>(data.size());
  std::string body;
  put(body, interface, static_cast<std::uint32_t>(time >> 32), static_cast<std::uint32_t>(time), size, size);
  body += data;
  pad(body);
  const std::string said = std::exchange(pending_, {}) + comment;
  put_option(body, kComment, said);
  if (!said.empty()) put(body, std::uint32_t{0});
  const std::string text = block(kEnhancedPacket, body);
  if (settings_.most != 0 && written_ + text.size() > settings_.most) turn_over();
  written_ += text.size();
  if (!output_.add(text)) ++dropped_;
}

}  // namespace cbcan::io
