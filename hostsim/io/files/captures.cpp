// SPDX-License-Identifier: MIT
#include "io/files/captures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "io/can/can_frames.hpp"
#include "sim/frame_text.hpp"

namespace cbcan::io {

namespace {

using base::Buffer;

constexpr std::size_t kCharactersPerWrite = 65536;

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

/// A part of base::append(): the bytes of a number.
template <class Number>
struct Raw {
  Number number;
  bool is_big;  ///< high byte first, else in this machine's byte order
};
template <class Number>
constexpr std::size_t room(Raw<Number> /*raw*/) {
  return sizeof(Number);
}
template <class Number>
char* write(char* at, Raw<Number> raw) {
  std::memcpy(at, &raw.number, sizeof raw.number);
  if (raw.is_big && std::endian::native == std::endian::little) std::reverse(at, at + sizeof raw.number);
  return at + sizeof raw.number;
}

template <class... Numbers>
void put(Buffer& to, Numbers... numbers) {
  base::append(to, Raw<Numbers>{numbers, false}...);
}

template <class... Numbers>
void put_big(Buffer& to, Numbers... numbers) {
  base::append(to, Raw<Numbers>{numbers, true}...);
}

/// All blocks of a file begin at a multiple of four.
void pad(Buffer& to) {
  while (to.size() % 4 != 0)
    base::append(to, '\0');
}

void put_option(Buffer& to, std::uint16_t code, std::string_view value) {
  if (value.empty()) return;
  put(to, code, static_cast<std::uint16_t>(value.size()));
  base::append(to, value);
  pad(to);
}

/// Appends a block without its size; returns where it begins.
template <class... Numbers>
std::size_t begin_block(Buffer& to, std::uint32_t type, Numbers... numbers) {
  const std::size_t begin = to.size();
  put(to, type, std::uint32_t{0}, numbers...);
  return begin;
}

void end_block(Buffer& to, std::size_t begin) {
  const auto size = static_cast<std::uint32_t>(to.size() - begin + sizeof(std::uint32_t));
  put(to, size);
  std::memcpy(to.data() + begin + sizeof(std::uint32_t), &size, sizeof size);
}

void put_interface(Buffer& to, std::uint16_t link_type, std::string_view name) {
  const std::size_t begin = begin_block(to, kInterface, link_type, std::uint16_t{0}, std::uint32_t{0});
  put_option(to, kInterfaceName, name);
  put(to, std::uint32_t{0});
  end_block(to, begin);
}

/// RFC 1071; `header` has an even number of bytes.
std::uint16_t checksum(std::string_view header) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < header.size(); i += 2)
    sum += static_cast<std::uint8_t>(header[i]) * 256U + static_cast<std::uint8_t>(header[i + 1]);
  sum = (sum & 0xFFFF) + (sum >> 16);
  return static_cast<std::uint16_t>(~(sum + (sum >> 16)));
}

void put_ip_header(Buffer& to, std::uint32_t from, std::uint32_t where, std::size_t size) {
  constexpr std::uint16_t kDoNotFragment = 0x4000;
  constexpr std::uint16_t kHopsAndTcp = 0x4006;
  const auto total = static_cast<std::uint16_t>(kIpBytes + size);
  const std::size_t begin = to.size();
  const auto put_header = [&](std::uint16_t sum) {
    put_big(to, std::uint16_t{0x4500}, total, std::uint16_t{0}, kDoNotFragment, kHopsAndTcp, sum, from,
            where);
  };
  put_header(0);
  const std::uint16_t sum = checksum(base::view(to, begin));
  to.resize(begin);
  put_header(sum);
}

}  // namespace

CandumpLog::CandumpLog(Settings settings, Warn warn)
    : settings_(std::move(settings)),
      where_("log " + settings_.path + ": "),
      warn_(std::move(warn)),
      output_(Output::open("log", settings_.path, settings_.most_waiting, settings_.content)),
      flush_at_(kCharactersPerWrite) {
  if (!output_.is_file()) settings_.most = 0;
}

CandumpLog::~CandumpLog() {
  flush();
  if (ended_) return;
  output_.finish();
  dropped_ += static_cast<std::uint64_t>(std::ranges::count(output_.take_rest(), '\n'));
  warn_of_missing(warn_, where_, dropped_, "frames");
}

void CandumpLog::on_bus_frame(const Frame& frame, Time now) {
  if (output_.waiting() >= flush_at_) flush();
  if (ended_ || !output_.room())
    ++dropped_;
  else
    sim::append_candump_line(output_.text(), frame, now + settings_.wall_offset, settings_.interface);
}

void CandumpLog::flush() {
  if (ended_) return;
  int error = 0;
  if (settings_.most != 0 && output_.waiting() != 0 && output_.size() + output_.waiting() > settings_.most)
    error = output_.turn_over(warn_, where_);
  if (error == 0) error = output_.flush();
  if (error != 0) return end(error);
  flush_at_ = std::min(output_.waiting() + kCharactersPerWrite, settings_.most_waiting);
  if (output_.waiting() == 0) warn_of_missing(warn_, where_, dropped_, "frames");
}

bool CandumpLog::reopen() {
  if (!output_.is_file()) return false;
  flush();
  const int error = output_.reopen();
  ended_ = false;
  if (error != 0) end(error);
  return true;
}

void CandumpLog::end(int error) {
  output_.take_rest();
  ended_ = true;
  warn_(where_ + reason(error) +
        "; the log ends here, the simulation goes on; make room, or write it to another disk");
}

PcapFile::PcapFile(const journal::Journal& journal, Settings settings, Comment comment, Warn warn)
    : journal_(journal),
      settings_(std::move(settings)),
      where_("pcap " + settings_.path + ": "),
      comment_(std::move(comment)),
      warn_(std::move(warn)),
      output_(Output::open("pcap", settings_.path, settings_.most_waiting)),
      cursor_(journal) {
  if (!output_.is_file()) settings_.most = 0;
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
  Buffer blocks;
  const std::size_t section =
      begin_block(blocks, kSectionHeader, kByteOrder, std::uint16_t{1}, std::uint16_t{0}, ~std::uint64_t{0});
  end_block(blocks, section);
  for (std::size_t network = 1; network <= settings_.networks; ++network)
    put_interface(blocks, kLinkTypeCan, fmt::format("can{}", network));
  put_interface(blocks, kLinkTypeRaw, "modbus");
  output_.add(base::view(blocks));
  written_ = blocks.size();
}

/// Pending output still goes to the old file.
void PcapFile::turn_over() {
  output_.finish();
  if (const int error = output_.turn_over(warn_, where_); error != 0) return end(error);
  begin();
}

void PcapFile::end(int error) {
  output_.take_rest();
  ended_ = true;
  warn_(where_ + reason(error) +
        "; it ends here, the simulation goes on; make room, or write it to another disk");
}

void PcapFile::poll() {
  const std::uint64_t missed = cursor_.look([this](std::uint64_t /*number*/, const journal::Event& event) {
    if (!ended_) add(event);
    return true;
  });
  dropped_ += missed;
  if (ended_) return;
  if (const int error = output_.flush(); error != 0) return end(error);
  if (output_.waiting() == 0) warn_of_missing(warn_, where_, dropped_, "packets");
}

/// A comment for an event that is no packet is a line before that of the next packet.
void PcapFile::add(const journal::Event& event) {
  const std::size_t before = comments_.size();
  comment_(comments_, event);
  if (event.kind == journal::Kind::kFrame) return add_can(event);
  if (event.kind == journal::Kind::kModbus && event.code != 0) return add_modbus(event, before);
  if (event.kind == journal::Kind::kClient && event.state == 0) sent_.erase(event.code);
  constexpr std::size_t kMostPending = 8192;  // an option has 65,535 bytes at most
  if (comments_.size() == before) return;
  if (before < kMostPending)
    base::append(comments_, '\n');
  else
    comments_.resize(before);
}

/// Adds a frame as in SocketCAN, but the identifier is big-endian.
void PcapFile::add_can(const journal::Event& event) {
  const Frame& frame = event.frame;
  constexpr std::size_t kHeader = 8;
  const std::size_t size = (frame.flags & Frame::kRemote) != 0 ? 0 : frame.length;
  begin_packet(event.network - 1U, event.at, kHeader + size);
  put_big(packet_, to_kernel(frame).can_id, frame.length, std::uint8_t{0}, std::uint8_t{0}, std::uint8_t{0});
  base::append(packet_, base::characters(Bytes(frame.data).first(size)));
  end_packet();
}

void PcapFile::add_modbus(const journal::Event& event, std::size_t comments_before) {
  const Bytes all = journal_.bytes(event);
  if (all.empty()) {
    comments_.resize(comments_before);
    ++dropped_;
    return;
  }
  add_segment(event, true, all.first(event.index));
  add_segment(event, false, all.subspan(event.index));
}

void PcapFile::add_segment(const journal::Event& event, bool is_request, Bytes pdu) {
  constexpr std::size_t kHeader = 7;
  constexpr std::uint16_t kPushAcknowledge = 0x5018;
  Sent& sent = sent_[event.code];
  std::uint32_t& own = is_request ? sent.requests : sent.responses;
  const std::uint32_t other = is_request ? sent.responses : sent.requests;
  const std::uint32_t client = kFirstClient + (event.code & 0xFFFFFF);
  const auto port = static_cast<std::uint16_t>(kFirstClientPort + event.code % 16384);
  const std::size_t size = kTcpBytes + kHeader + pdu.size();
  begin_packet(static_cast<std::uint32_t>(settings_.networks), event.at, kIpBytes + size);
  put_ip_header(packet_, is_request ? client : kServer, is_request ? kServer : client, size);
  put_big(packet_, is_request ? port : kModbusPort, is_request ? kModbusPort : port, own, other,
          kPushAcknowledge, std::uint16_t{0xFFFF}, std::uint32_t{0});
  put_big(packet_, event.result, std::uint16_t{0}, static_cast<std::uint16_t>(1 + pdu.size()), event.node);
  base::append(packet_, base::characters(pdu));
  own += static_cast<std::uint32_t>(kHeader + pdu.size());
  end_packet();
}

void PcapFile::begin_packet(std::uint32_t interface, Time at, std::size_t size) {
  const Time time = at + settings_.wall_offset;
  const auto count = static_cast<std::uint32_t>(size);
  packet_.clear();
  begin_block(packet_, kEnhancedPacket, interface, static_cast<std::uint32_t>(time >> 32),
              static_cast<std::uint32_t>(time), count, count);
}

/// Adds all comments since the last packet.
void PcapFile::end_packet() {
  pad(packet_);
  put_option(packet_, kComment, base::view(comments_));
  if (comments_.size() != 0) put(packet_, std::uint32_t{0});
  comments_.clear();
  end_block(packet_, 0);
  if (settings_.most != 0 && written_ + packet_.size() > settings_.most) turn_over();
  if (ended_) return;
  written_ += packet_.size();
  if (!output_.add(base::view(packet_))) ++dropped_;
}

}  // namespace cbcan::io
