// SPDX-License-Identifier: MIT
// Every state of the SDO client times every kind of event. A state without a row and a row without all its
// cells fail.

#include "cbcan/canopen/sdo/client.hpp"
#include "support/bench.hpp"

namespace cbcan::test {
namespace {

using enum SdoClient::Phase;
using Phase = SdoClient::Phase;
using Direction = SdoClient::Direction;
using Mode = SdoClient::Mode;

enum Event : std::size_t {
  kResponse,      ///< what the state waits for
  kMisplaced,     ///< a command specifier that does not belong there
  kAbort,         ///< for this transfer
  kForeignAbort,  ///< for another object
  kOtherObject,   ///< a response with another index
  kShort,         ///< a frame without its bytes
  kRemote,        ///< an RTR frame
  kOtherNode,     ///< another node's response
  kBootUp,        ///< of this node
  kOtherBootUp,   ///< of another node
  kRoom,          ///< the port takes frames, and time for another try has come
  kDeadline,      ///< the state's time is over
  kCancel,
  kEvents
};
constexpr const char* kEventNames[kEvents] = {"response",
                                              "misplaced response",
                                              "abort",
                                              "abort for another object",
                                              "response for another object",
                                              "short frame",
                                              "RTR",
                                              "another node's response",
                                              "boot-up",
                                              "another node's boot-up",
                                              "room",
                                              "deadline",
                                              "cancel"};

/// What has to follow: the next state, the abort code when the transfer has failed, and the frames that
/// leave.
struct Cell {
  bool written = false;
  Phase next = kIdle;
  std::uint32_t code = 0;
  std::array<const char*, 2> sent{};
};
constexpr Cell to(Phase next, const char* first = nullptr, const char* second = nullptr) {
  return {true, next, 0, {first, second}};
}
constexpr Cell failed(std::uint32_t code, const char* sent = nullptr) {
  return {true, kIdle, code, {sent, nullptr}};
}

// Aborts as they leave for node 5, object 2000h sub-index 1.
constexpr Cell kSync = failed(0x05040001, "605#8000200101000405");
constexpr Cell kTimedOut = failed(0x05040000, "605#8000200100000405");
constexpr Cell kTheirs = failed(0x06020000);
constexpr Cell kRebooted = failed(0x08000022);
constexpr Cell kCancelled = to(kIdle, "605#8000200100000008");

/// Of a state that waits for a response, and for nothing else.
constexpr std::array<Cell, kEvents> waits(Phase phase, Cell response) {
  const Cell stays = to(phase);
  return {response, kSync,     kTheirs, stays, stays,     stays,     stays,
          stays,    kRebooted, stays,   stays, kTimedOut, kCancelled};
}

struct Row {
  Phase phase;
  /// Brings a new client into the state.
  void (*enter)(SdoClient&, RecordingPort&);
  const char* response;
  const char* misplaced;
  std::array<Cell, kEvents> cells;
};

SdoClient::Request request(Direction direction, Mode mode, std::uint16_t size, std::uint8_t node = 5) {
  return {node, 1, 0x2000, size, direction, mode};
}
void read(SdoClient& client, Mode mode) {
  client.start(request(Direction::kRead, mode, 14), 0);
}
void write(SdoClient& client, Mode mode, std::uint16_t size) {
  client.start(request(Direction::kWrite, mode, size), 0);
}
void arrive(SdoClient& client, const char* frame, Time now = 0) {
  client.on_frame(frame_from(frame), now);
}

void time_out(SdoClient& client) {
  read(client, Mode::kAuto);
  client.poll(1000 * kMillisecond);
}

constexpr Row kRows[] = {
    {kIdle,
     [](SdoClient&, RecordingPort&) {},
     "585#4300200100000000",
     "585#E000000000000000",
     {to(kIdle), to(kIdle), to(kIdle), to(kIdle), to(kIdle), to(kIdle), to(kIdle), to(kIdle), to(kIdle),
      to(kIdle), to(kIdle), to(kIdle), to(kIdle)}},
    {kHeldBack,
     [](SdoClient& client, RecordingPort&) {
       time_out(client);
       read(client, Mode::kAuto);
     },
     // What may be the late response sets the request free.
     "585#4300200100000000",
     "585#E000000000000000",
     {to(kUploadInitiate, "605#4000200100000000"), to(kUploadInitiate, "605#4000200100000000"),
      to(kUploadInitiate, "605#4000200100000000"), to(kHeldBack), to(kHeldBack), to(kHeldBack), to(kHeldBack),
      to(kHeldBack), to(kUploadInitiate, "605#4000200100000000"), to(kHeldBack), to(kHeldBack),
      to(kUploadInitiate, "605#4000200100000000"), to(kIdle)}},
    {kQueued,
     [](SdoClient& client, RecordingPort& port) {
       read(client, Mode::kAuto);
       port.refuse_next = RecordingPort::kAlways;
       client.poll(1000 * kMillisecond);
       client.start(request(Direction::kRead, Mode::kAuto, 14, 6), 1000 * kMillisecond);
     },
     "586#4300200100000000",
     "586#E000000000000000",
     {to(kQueued), to(kQueued), to(kQueued), to(kQueued), to(kQueued), to(kQueued), to(kQueued), to(kQueued),
      to(kQueued), to(kQueued), to(kUploadInitiate, "605#8000200100000405", "606#4000200100000000"),
      failed(0x05040000), to(kIdle)}},
    {kUploadInitiate, [](SdoClient& client, RecordingPort&) { read(client, Mode::kAuto); },
     "585#410020010E000000", "585#6000200100000000",
     waits(kUploadInitiate, to(kUploadSegment, "605#6000000000000000"))},
    {kUploadSegment,
     [](SdoClient& client, RecordingPort&) {
       read(client, Mode::kAuto);
       arrive(client, "585#410020010E000000");
     },
     "585#0001020304050607", "585#2000000000000000",
     waits(kUploadSegment, to(kUploadSegment, "605#7000000000000000"))},
    {kDownloadExpedited, [](SdoClient& client, RecordingPort&) { write(client, Mode::kAuto, 2); },
     "585#6000200100000000", "585#2000000000000000", waits(kDownloadExpedited, to(kIdle))},
    {kDownloadInitiate, [](SdoClient& client, RecordingPort&) { write(client, Mode::kAuto, 14); },
     "585#6000200100000000", "585#4300200100000000",
     waits(kDownloadInitiate, to(kDownloadSegment, "605#0000000000000000"))},
    {kDownloadSegment,
     [](SdoClient& client, RecordingPort&) {
       write(client, Mode::kAuto, 14);
       arrive(client, "585#6000200100000000");
     },
     "585#2000000000000000", "585#0000000000000000",
     waits(kDownloadSegment, to(kDownloadSegment, "605#1100000000000000"))},
    {kBlockDownloadInitiate,
     [](SdoClient& client, RecordingPort&) { write(client, Mode::kBlock, 14); },
     "585#A400200102000000",
     "585#6000200100000000",
     {to(kBlockDownloadAcknowledge, "605#0100000000000000", "605#8200000000000000"), kSync, kTheirs,
      to(kBlockDownloadInitiate), to(kBlockDownloadInitiate), to(kBlockDownloadInitiate),
      to(kBlockDownloadInitiate), to(kBlockDownloadInitiate), kRebooted, to(kBlockDownloadInitiate),
      to(kBlockDownloadInitiate), kTimedOut, kCancelled}},
    {kBlockDownloadStream,
     [](SdoClient& client, RecordingPort& port) {
       write(client, Mode::kBlock, 14);
       port.refuse_next = RecordingPort::kAlways;
       arrive(client, "585#A400200102000000");
     },
     // Nothing can be answered yet: the sub-block has not been sent.
     "585#A201020000000000",
     "585#6000200100000000",
     {to(kBlockDownloadStream), to(kBlockDownloadStream), kTheirs, to(kBlockDownloadStream),
      to(kBlockDownloadStream), to(kBlockDownloadStream), to(kBlockDownloadStream), to(kBlockDownloadStream),
      kRebooted, to(kBlockDownloadStream),
      to(kBlockDownloadAcknowledge, "605#0100000000000000", "605#8200000000000000"), failed(0x05040000),
      to(kIdle)}},
    {kBlockDownloadAcknowledge,
     [](SdoClient& client, RecordingPort&) {
       write(client, Mode::kBlock, 14);
       arrive(client, "585#A400200102000000");
     },
     "585#A202020000000000", "585#A100000000000000",
     waits(kBlockDownloadAcknowledge, to(kBlockDownloadEnd, "605#C100000000000000"))},
    {kBlockDownloadEnd,
     [](SdoClient& client, RecordingPort&) {
       write(client, Mode::kBlock, 14);
       arrive(client, "585#A400200102000000");
       arrive(client, "585#A202020000000000");
     },
     "585#A100000000000000", "585#A202020000000000", waits(kBlockDownloadEnd, to(kIdle))},
    {kBlockUploadInitiate, [](SdoClient& client, RecordingPort&) { read(client, Mode::kBlock); },
     "585#C60020010E000000", "585#4300200100000000",
     waits(kBlockUploadInitiate, to(kBlockUploadStream, "605#A300000000000000"))},
    {kBlockUploadStream,
     [](SdoClient& client, RecordingPort&) {
       read(client, Mode::kBlock);
       arrive(client, "585#C60020010E000000");
     },
     // Byte 0 is a sequence number: 60h is one that was not asked for, 43h too; half the timeout asks for
     // the rest.
     "585#0101020304050607",
     "585#6000200100000000",
     {to(kBlockUploadStream), failed(0x05040003, "605#8000200103000405"), kTheirs, to(kBlockUploadStream),
      failed(0x05040003, "605#8000200103000405"), to(kBlockUploadStream), to(kBlockUploadStream),
      to(kBlockUploadStream), kRebooted, to(kBlockUploadStream), to(kBlockUploadStream),
      to(kBlockUploadStream, "605#A200020000000000"), kCancelled}},
    {kBlockUploadEnd,
     [](SdoClient& client, RecordingPort&) {
       read(client, Mode::kBlock);
       arrive(client, "585#C60020010E000000");
       arrive(client, "585#0100000000000000");
       arrive(client, "585#8200000000000000");
     },
     "585#C100000000000000", "585#6000200100000000",
     waits(kBlockUploadEnd, to(kIdle, "605#A100000000000000"))},
};

void happen(Event event, const Row& row, SdoClient& client, RecordingPort& port, Time now) {
  const bool other_node_asked = row.response[2] == '6';
  const std::uint8_t node = other_node_asked ? 6 : 5;
  const std::string id = other_node_asked ? "586" : "585";
  switch (event) {
    case kResponse: return arrive(client, row.response, now);
    case kMisplaced: return arrive(client, row.misplaced, now);
    case kAbort: return arrive(client, (id + "#8000200100000206").c_str(), now);
    case kForeignAbort: return arrive(client, (id + "#8000210100000206").c_str(), now);
    case kOtherObject: return arrive(client, (id + "#4300210100000000").c_str(), now);
    case kShort: return arrive(client, (id + "#").c_str(), now);
    case kRemote: return arrive(client, (id + "#R8").c_str(), now);
    case kOtherNode: return arrive(client, "590#4300200100000000", now);
    case kBootUp: return client.on_boot_up(node, now);
    case kOtherBootUp: return client.on_boot_up(16, now);
    case kRoom: port.refuse_next = 0; return client.poll(now + kRetryInterval);
    case kDeadline: return client.poll(now + 1000 * kMillisecond);
    case kCancel: return client.cancel(now);
    case kEvents: break;
  }
  FAIL("an event without a meaning");
}

TEST_CASE("state table: every state of the SDO client has a row") {
  for (std::size_t phase = 0; phase < SdoClient::kPhases; ++phase) {
    INFO("state " << phase);
    CHECK(std::ranges::count(kRows, static_cast<Phase>(phase), &Row::phase) == 1);
  }
}

std::vector<std::string> frames_of(const Cell& cell) {
  std::vector<std::string> frames;
  for (const char* frame : cell.sent)
    if (frame != nullptr) frames.emplace_back(frame);
  return frames;
}

TEST_CASE("state table: every event in every state") {
  for (const Row& row : kRows) {
    for (std::size_t event = 0; event < kEvents; ++event) {
      INFO("state " << static_cast<int>(row.phase) << ", event: " << kEventNames[event]);
      const Cell& cell = row.cells[event];
      CHECK(cell.written);
      RecordingPort port;
      std::array<std::uint8_t, 128> data{};
      SdoClient client(port, data);
      row.enter(client, port);
      REQUIRE(client.phase() == row.phase);
      port.sent.clear();
      const Time now = row.phase == kHeldBack || row.phase == kQueued ? 1000 * kMillisecond : 0;
      happen(static_cast<Event>(event), row, client, port, now);
      CHECK(client.phase() == cell.next);
      CHECK(std::vector<std::string>(port.sent.begin(), port.sent.end()) == frames_of(cell));
      CHECK((client.outcome() == SdoClient::Outcome::kFailed) == (cell.code != 0));
      if (cell.code != 0) CHECK(static_cast<std::uint32_t>(client.error()) == cell.code);
    }
  }
}

}  // namespace
}  // namespace cbcan::test
