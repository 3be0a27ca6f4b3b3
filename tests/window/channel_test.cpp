// SPDX-License-Identifier: MIT
// The PLC's side of the registers, request by request; words from docs/reference/contract.md and
// docs/reference/registers.md.
#include "cbcan/window.hpp"

#include "support/catch.hpp"

namespace cbcan::window::test {
namespace {

using Words = std::vector<std::uint16_t>;

const Transaction kRead{.command = 5055, .node = 0x42, .index = 0x6411, .sub = 1, .size = 2};

/// The next request: "write 3700: 0", "read 3700 8".
std::string next_of(Channel& channel) {
  const std::optional<Request> request = channel.next();
  if (!request) return "none";
  std::string text;
  if (!request->words.empty()) text += "write " + std::to_string(request->write_address) + ":";
  for (const std::uint16_t word : request->words)
    text += " " + std::to_string(word);
  if (request->count == 0) return text;
  return text + (text.empty() ? "" : ", ") + "read " + std::to_string(request->read_address) + " " +
         std::to_string(request->count);
}

/// Carries out `transaction` up to the first poll for its result.
void start(Channel& channel, const Transaction& transaction, const Words& head = {}) {
  channel.begin(transaction);
  for (const Words& words : {head, Words{}}) {
    channel.next();
    channel.answered({.words = words});
  }
}

TEST_CASE("R3700: cleared, everything in one request, and read until it has changed") {
  Channel channel(1);
  channel.begin(kRead);
  CHECK(next_of(channel) == "write 3700: 0");
  channel.answered({});
  CHECK(next_of(channel) == "write 3700: 51726 5055 66 25617 1 2");  // CA0Eh
  channel.answered({});
  CHECK(next_of(channel) == "read 3700 8");
  channel.answered({.words = {0xCA0E, 5055, 0x42, 0x6411, 1, 2, 0, 0}});
  CHECK(channel.waiting());
  CHECK_FALSE(channel.take());
  CHECK(next_of(channel) == "read 3700 8");
  channel.answered({.words = {0, 5055, 0x42, 0x6411, 1, 2, 300, 0x0602}});
  CHECK_FALSE(channel.busy());
  const std::optional<Result> result = channel.take();
  REQUIRE(result);
  CHECK(result->known);
  CHECK(result->code == 0);
  CHECK(result->data == std::vector<std::uint8_t>{0x2C, 0x01});
  CHECK_FALSE(channel.take());
  channel.begin(kRead);  // no clearing now
  CHECK(next_of(channel) == "write 3700: 51726 5055 66 25617 1 2");
}

TEST_CASE("an abort code has its low word first; a write has its bytes, the first one low") {
  Channel channel(1);
  start(channel, {.command = 5066, .node = 5, .index = 0x2001, .sub = 0, .size = 3, .data = {1, 2, 3}});
  CHECK(next_of(channel) == "read 3700 8");
  channel.answered({.words = {4, 5066, 5, 0x2001, 0, 3, 0x0010, 0x0607}});
  const Result result = *channel.take();
  CHECK(result.code == 4);
  CHECK(result.abort_code == 0x0607'0010);
  channel.begin({.command = 5066, .node = 5, .index = 0x2001, .sub = 0, .size = 3, .data = {1, 2, 3}});
  CHECK(next_of(channel) == "write 3700: 51726 5066 5 8193 0 3 513 3");
}

TEST_CASE("start rule: 0 in R3700, and another request in R3701..R3704, is not known to be a result") {
  const Words written{0xCA0E, 5055, 0x42, 0x6411, 1, 2};
  CHECK(is_known(written, Words{0, 5055, 0x42, 0x6411, 1, 4}));  // R3705 may be changed by the module
  CHECK(is_known(written, Words{0, 5055, 0x42}));
  for (std::size_t at = 1; at <= 4; ++at) {
    Words now{0, 5055, 0x42, 0x6411, 1, 2, 0, 0};
    now[at] = 0;
    CHECK_FALSE(is_known(written, now));
    Channel channel(1);
    start(channel, kRead);
    channel.next();
    channel.answered({.words = now});
    CHECK_FALSE(channel.take()->known);
  }
}

TEST_CASE("another program's transaction in R3700 is waited for") {
  Channel channel(1, Channel::Found::kIsWaitedFor);
  channel.begin(kRead);
  CHECK(next_of(channel) == "read 3700 1");
  channel.answered({.words = {0xCA0E}});
  CHECK(channel.occupied());
  CHECK(next_of(channel) == "read 3700 1");
  channel.answered({.words = {0}});
  CHECK_FALSE(channel.occupied());
  CHECK(next_of(channel) == "write 3700: 51726 5055 66 25617 1 2");
}

TEST_CASE("what has begun is cancelled by 0, and what has not by nothing") {
  Channel channel(1);
  start(channel, kRead);
  channel.cancel();
  CHECK(channel.cancelling());
  CHECK(next_of(channel) == "write 3700: 0");
  channel.answered({});
  CHECK(next_of(channel) == "none");
  channel.begin(kRead);
  channel.cancel();
  CHECK(next_of(channel) == "none");
}

TEST_CASE(
    "a scanner window: 200 registers a channel, numbers go on after the one taken last, 1 after 65535") {
  Channel channel(2);
  channel.begin(kRead);
  CHECK(next_of(channel) == "write 700: 0, read 800 3");
  channel.answered({.words = {65535, 0, 65535}});
  CHECK(next_of(channel) == "write 700: 1 5055 66 25617 1 2");
  channel.answered({});
  CHECK(next_of(channel) == "read 800 6");
  channel.answered({.words = {65535, 0, 65535, 0, 0, 0}});  // another number was taken: a restart
  CHECK_FALSE(channel.take()->known);
}

TEST_CASE("a scanner window: the result is the one of the number") {
  Channel channel(2);
  start(channel, kRead, {7, 0, 7});
  channel.next();
  channel.answered({.words = {7, 4, 8, 4, 0, 0x0504}});
  CHECK(channel.waiting());
  channel.next();
  channel.answered({.words = {8, 0, 8, 2, 300, 0}});
  const Result result = *channel.take();
  CHECK(result.known);
  CHECK(result.data == std::vector<std::uint8_t>{0x2C, 0x01});
}

TEST_CASE("a channel that the module does not have: nothing was taken and nothing says that it has started") {
  Channel missing(16), started(16), refused(16);
  for (Channel* channel : {&missing, &started, &refused})
    CHECK(next_of(*channel) == "write 3500: 0, read 3600 3");
  missing.answered({.words = {0, 0, 0}});
  started.answered({.words = {0, 5, 0}});
  refused.answered({.exception = 2});
  for (Channel* channel : {&missing, &refused}) {
    CHECK(channel->absent());
    CHECK(next_of(*channel) == "write 3500: 0, read 3600 3");  // the state is unknown
  }
  CHECK_FALSE(started.absent());
}

}  // namespace
}  // namespace cbcan::window::test
