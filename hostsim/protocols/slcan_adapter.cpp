// SPDX-License-Identifier: MIT
// A CAN adapter with a serial line, on a simulated bus: behaves as a LAWICEL CAN232 or CANUSB (the manual is
// named in firmware/cbcan/slcan/slcan.hpp).
//
// Commands, each ended by CR and answered by CR, or by BEL where it cannot be done:
//   Sn             bit rate, n = 0..8: accepted while closed, without effect, and not needed before O
//   O, L, C        open, open to listen only, close
//   tiiil.., Tiiiiiiiil.., riiil, Riiiiiiiil
//                  send a frame: answered by z CR or Z CR; BEL where the transmit queue (64 frames) is full
//   F              status flags, Fxx: only while open; reading clears them
//   V, N           versions, V1013; serial number, NCB01
//   Z0, Z1         time stamps off, on, while closed: milliseconds, modulo one minute
//   Mxxxxxxxx, mxxxxxxxx
//                  acceptance code and mask: accepted while closed, without effect; every frame passes
// A change of the controller's state is sent unrequested, as s and the state (slcan::decode_state); the error
// counters in it are the lowest that belong to the state.

#include <array>

#include "base/text.hpp"
#include "cbcan/slcan/slcan.hpp"
#include "protocols/adapter.hpp"

namespace cbcan::protocols {

namespace {

constexpr Time kTimeStampPeriod = 60 * kSecond;
constexpr std::string_view kYes = "\r";
constexpr std::string_view kNo = "\a";

bool is_hex(std::string_view text) {
  return text.find_first_not_of("0123456789ABCDEFabcdef") == std::string_view::npos;
}

class SlcanAdapter final : public Adapter {
 public:
  using Adapter::Adapter;

  void receive(std::string_view characters) override {
    using Event = slcan::LineReader::Event;
    for (const char c : characters) {
      const Event event = reader_.on_char(c);
      if (event == Event::kNone || event == Event::kBell) continue;
      if (event != Event::kLine || !execute(reader_.line())) respond(kNo);
    }
  }

  void on_frame(const Frame& frame, Time now) override {
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

  void on_bus_state(BusState state, Time /*now*/) override {
    if (!is_open()) return;
    switch (state) {
      case BusState::kActive: unsent_ += "sa000000\r"; break;
      case BusState::kOverflow: break;
      case BusState::kErrorPassive: unsent_ += "sp128128\r"; break;
      case BusState::kBusOff: unsent_ += "sb000256\r"; break;
    }
  }

 private:
  enum class Channel : std::uint8_t { kClosed, kOpen, kListening };

  /// Returns true, so that a command that only responds is done.
  bool respond(std::string_view text) {
    unsent_ += text;
    return true;
  }

  /// False: the command cannot be done; otherwise it has been answered.
  bool execute(std::string_view line) {
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

  bool open(Channel channel) {
    if (is_open()) return false;
    channel_ = channel;
    flags_ = 0;
    port_.accept_all();
    return true;
  }

  bool close() {
    if (!is_open()) return false;
    channel_ = Channel::kClosed;
    port_.refuse_all();
    return true;
  }

  /// The response comes before any frames that this one causes.
  bool send(std::string_view line) {
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

  bool tell_status() {
    if (!is_open()) return false;
    std::uint8_t flags = std::exchange(flags_, std::uint8_t{0});
    if (port_.state() == BusState::kOverflow) flags |= slcan::status::kDataOverrun;
    if (port_.state() == BusState::kErrorPassive) flags |= slcan::status::kErrorPassive;
    if (port_.state() == BusState::kBusOff) flags |= slcan::status::kErrorPassive | slcan::status::kBusError;
    unsent_ += 'F';
    unsent_ += base::hex(flags, 2);
    return true;
  }

  bool is_open() const { return channel_ != Channel::kClosed; }

  slcan::LineReader reader_;
  Channel channel_ = Channel::kClosed;
  bool time_stamps_ = false;
  std::uint8_t flags_ = 0;  ///< for F, which clears them
};

}  // namespace

std::unique_ptr<StreamSession> slcan_adapter(sim::Bus& bus, Adapter::OnQueued on_queued,
                                             std::size_t most_unsent, std::uint64_t* lost) {
  return std::make_unique<SlcanAdapter>(bus, std::move(on_queued), most_unsent, lost);
}

}  // namespace cbcan::protocols
