// SPDX-License-Identifier: MIT
// One exchange between a master and another station, on a port where silence may go undetected: with every
// function code of known lengths, containing a request for this station at every possible place after a CRC
// that is right so far (a trap), with t3.5 of silence at every place, after each kind of frame. Nothing of it
// is executed; the requests for this station before and after it are.

#include "modbus/line.hpp"
#include "support/catch.hpp"
#include "support/modbus_crc.hpp"

namespace cbcan {
namespace {

using namespace test;

constexpr std::size_t kData = 24;                        // counted bytes of a frame
constexpr std::size_t kTrap = 2 + 8;                     // a CRC and a request
const Bytes kHarmToR7 = hex("01 06 00 07 0B AD FE 86");  // 0BADh to R7
const Bytes kOurs = hex("01 06 00 01 00 03 98 0B");      // V1.1b3, 6.6
constexpr std::size_t kNoTrap = 0;

/// `head` and its data, with a trap at `at`.
Bytes frame_of(Bytes head, std::size_t data, std::size_t at) {
  head.insert(head.end(), data, 0x5A);
  if (at != kNoTrap) {
    const Bytes before = with_crc(Bytes(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(at)));
    std::copy(before.begin(), before.end(), head.begin());
    std::copy(kHarmToR7.begin(), kHarmToR7.end(), head.begin() + static_cast<std::ptrdiff_t>(at + 2));
  }
  return with_crc(head);
}

/// A request and its response to station 9; those that end in a count are followed by kData bytes.
struct Exchange {
  const char *request, *response;
};
const Exchange kExchanges[] = {
    {"09 01 00 13 00 C0", "09 01 18"},
    {"09 02 00 C4 00 C0", "09 02 18"},
    {"09 03 00 6B 00 0C", "09 03 18"},
    {"09 04 00 08 00 0C", "09 04 18"},
    {"09 05 00 AC FF 00", "09 05 00 AC FF 00"},
    {"09 06 00 01 00 03", "09 06 00 01 00 03"},
    {"09 07", "09 07 6D"},
    {"09 0B", "09 0B FF FF 01 08"},
    {"09 0C", "09 0C 18"},
    {"09 0F 00 13 00 C0 18", "09 0F 00 13 00 C0"},
    {"09 10 00 01 00 0C 18", "09 10 00 01 00 0C"},
    {"09 11", "09 11 18"},
    {"09 14 18", "09 14 18"},
    {"09 15 18", "09 15 18"},
    {"09 16 00 04 00 F2 00 25", "09 16 00 04 00 F2 00 25"},
    {"09 17 00 03 00 0C 00 0E 00 0C 18", "09 17 18"},
    {"09 18 04 DE", "09 18 00 18"},
};

bool counts(const Bytes& head) {
  return head.back() == kData;
}

/// A frame without a trap, and with one at each place.
std::vector<Bytes> forms_of(const Bytes& head) {
  const std::size_t data = counts(head) ? kData : 0;
  std::vector<Bytes> forms{frame_of(head, data, kNoTrap)};
  for (std::size_t at = head.size(); at + kTrap <= head.size() + data; ++at)
    forms.push_back(frame_of(head, data, at));
  return forms;
}

/// The previous frame on the line, with t3.5 or a gap after it.
struct Before {
  const char* frame;
  bool gap;
  bool in_step;  ///< a request is expected next, so that it is received without a gap
};
const Before kBefore[] = {
    {"", true, false},
    {"01 03 00 00 00 01 84 0A", false, true},     // for this station
    {"00 06 00 00 00 00 88 1B", false, true},     // for all
    {"0A 03 00 6B 00 03 75 6C", false, true},     // a request to a station that does not exist
    {"09 03 00 6B 00 03 75 5F", true, true},      // a request that got no response
    {"09 03 00 6B 00 03 75 5F 00", true, false},  // a broken frame
    {"09 2B 0E 01 00 91 B6", true, false},        // of unknown length
};

struct Conversation {
  explicit Conversation(const Before& before) : line_(late_port()) {
    line_.gap();
    send(hex(before.frame));
    before.gap ? line_.gap() : pause();
    executed_ = line_.server.counters().slave_messages;
  }
  /// With t3.5 of silence before byte `cut`.
  void send(const Bytes& frame, std::size_t cut = 0) {
    for (std::size_t i = 0; i < frame.size(); ++i) {
      if (i == cut && i != 0) pause();
      line_.send({frame[i]});
    }
  }
  void pause() { line_.response(), line_.wait(1'750); }
  void gap() { line_.response(), line_.gap(); }
  bool hears_ours() {
    line_.send(kOurs);
    return line_.response() == kOurs;
  }
  bool harmed() const { return line_.words[7] != 0 || line_.server.counters().slave_messages != executed_; }

 private:
  Line line_;
  std::uint32_t executed_ = 0;
};

/// `cut` is an offset in the request followed by the response.
void check(const Before& before, const Bytes& request, const Bytes& response, std::size_t cut) {
  Conversation conversation(before);
  conversation.send(request, cut);
  conversation.pause();
  conversation.send(response, cut - request.size());
  before.in_step ? conversation.pause() : conversation.gap();
  if (conversation.harmed()) FAIL("executed, cut at " << cut);
  if (!conversation.hears_ours()) FAIL("ours is not heard, cut at " << cut);
}

void check_cuts(const Before& before, const Bytes& request, const Bytes& response) {
  for (std::size_t cut = 1; cut < request.size() + response.size(); ++cut)
    if (cut != request.size()) check(before, request, response, cut);
}

TEST_CASE("RTU: no request within another station's exchange is executed, wherever it is or pauses") {
  for (const Exchange& exchange : kExchanges) {
    INFO(exchange.request);
    const std::vector<Bytes> requests = forms_of(hex(exchange.request)),
                             responses = forms_of(hex(exchange.response));
    for (const Before& before : kBefore) {
      INFO(before.frame);
      for (const Bytes& request : requests)
        check_cuts(before, request, responses[0]);
      for (const Bytes& response : responses)
        check_cuts(before, requests[0], response);
    }
  }
}

}  // namespace
}  // namespace cbcan
