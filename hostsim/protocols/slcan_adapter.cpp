// SPDX-License-Identifier: MIT
#include "protocols/slcan_adapter.hpp"

#include <array>
#include <utility>

#include "base/numbers.hpp"

namespace cbcan::protocols {

namespace {

constexpr Time kTimeStampPeriod = 60 * kSecond;
constexpr std::string_view kYes = "\r";
constexpr std::string_view kNo = "\a";

bool is_hex(std::string_view text) {
  return text.find_first_not_of("0123456789ABCDEFabcdef") == std::string_view::npos;
}

}  // namespace

void SlcanAdapter::receive(std::string_view characters) {
  using Event = slcan::LineReader::Event;
  for (const char c : characters) {
    const Event event = reader_.on_char(c);
    if (event == Event::kNone || event == Event::kBell) continue;
    if (event != Event::kLine || !execute(reader_.line())) respond(kNo);
  }
}

/// Returns true, so that a command that only responds is done.
bool SlcanAdapter::respond(std::string_view text) {
  unsent_ += text;
  return true;
}

/// False: the command cannot be done; otherwise it has been answered.
bool SlcanAdapter::execute(std::string_view line) {
  const char command = line.empty() ? slcan::kEnd : line[0];
  bool done = false;
  switch (command) {
    case 't':
    case 'T':
    case 'r':
    case 'R': return send(line);
    case slcan::kEnd: done = true; break;
    case 'O': done = line.size() == 1 && open(Channel::kOpen); break;
    case 'L': done = line.size() == 1 && open(Channel::kListening); break;
    case 'C': done = line.size() == 1 && close(); break;
    case 'S': done = line.size() == 2 && line[1] >= '0' && line[1] <= '8' && !is_open(); break;
    case 'Z':
      done = (line == "Z0" || line == "Z1") && !is_open();
      if (done) time_stamps_ = line == "Z1";
      break;
    case 'M':
    case 'm': done = line.size() == 9 && is_hex(line.substr(1)) && !is_open(); break;
    case 'F': done = line.size() == 1 && tell_status(); break;
    case 'V': done = line.size() == 1 && respond("V1013"); break;
    case 'N': done = line.size() == 1 && respond("NCB01"); break;
    default: break;
  }
  if (done) respond(kYes);
  return done;
}

bool SlcanAdapter::open(Channel channel) {
  if (is_open()) return false;
  channel_ = channel;
  flags_ = 0;
  port_.accept_all();
  return true;
}

bool SlcanAdapter::close() {
  if (!is_open()) return false;
  channel_ = Channel::kClosed;
  port_.refuse_all();
  return true;
}

/// The response comes before any frames that this one causes.
bool SlcanAdapter::send(std::string_view line) {
  Frame frame;
  if (channel_ != Channel::kOpen || !slcan::decode(line, frame)) return false;
  if (!port_.try_send(frame)) {
    flags_ |= slcan::status::kTransmitFull;
    return false;
  }
  respond((frame.flags & Frame::kExtended) != 0 ? "Z\r" : "z\r");
  on_queued_();
  return true;
}

bool SlcanAdapter::tell_status() {
  if (!is_open()) return false;
  std::uint8_t flags = std::exchange(flags_, std::uint8_t{0});
  if (port_.state() == BusState::kOverflow) flags |= slcan::status::kDataOverrun;
  if (port_.state() == BusState::kErrorPassive) flags |= slcan::status::kErrorPassive;
  if (port_.state() == BusState::kBusOff) flags |= slcan::status::kErrorPassive | slcan::status::kBusError;
  unsent_ += 'F';
  unsent_ += base::hex(flags, 2);
  return true;
}

void SlcanAdapter::on_frame(const Frame& frame, Time now) {
  std::array<char, slcan::kMaxLine> line;
  std::size_t length = slcan::encode(frame, line);
  if (length == 0) return;
  if (!has_room(line.size())) {
    flags_ |= slcan::status::kReceiveFull | slcan::status::kDataOverrun;
    return;
  }
  unsent_.append(line.data(), length - kYes.size());
  if (time_stamps_) unsent_ += base::hex(now % kTimeStampPeriod / kMillisecond, 4);
  unsent_ += slcan::kEnd;
}

void SlcanAdapter::on_bus_state(BusState state, Time /*now*/) {
  if (!is_open()) return;
  switch (state) {
    case BusState::kActive: unsent_ += "sa000000\r"; break;
    case BusState::kOverflow: break;
    case BusState::kErrorPassive: unsent_ += "sp128128\r"; break;
    case BusState::kBusOff: unsent_ += "sb000256\r"; break;
  }
}

}  // namespace cbcan::protocols
