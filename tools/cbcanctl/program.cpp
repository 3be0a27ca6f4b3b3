// SPDX-License-Identifier: MIT
// program: program download (CiA 302-3) into a node.

#include <fmt/core.h>
#include <unistd.h>

#include <iostream>

#include "cbcanctl/commands.hpp"
#include "descriptions/dictionary_image.hpp"

namespace cbcan::ctl {

namespace {

using tools::Bytes;
using window::Result;

constexpr std::chrono::milliseconds kPause{100};
constexpr int kMostPauses = 600;

struct Update {
  window::Client& client;
  std::uint8_t node;

  static void stop_if_interrupted() {
    if (interrupted()) throw window::Error(window::Error::Cause::kInterrupted, "cancelled");
  }
  void pause() const {
    client.pause(kPause);
    stop_if_interrupted();
  }
  void check(const Result& response, std::string_view step) const {
    if (response.code != 0) throw Refused(response, fmt::format("node {}: {}", node, step));
  }
  /// The node does not respond, has restarted before it did, or has responded to a request before this one.
  static bool is_silent(const Result& response) {
    const auto code = static_cast<AbortCode>(response.abort_code);
    return code == AbortCode::kTimeOut || code == AbortCode::kDeviceState || code == AbortCode::kSync;
  }
  [[noreturn]] void fail(std::string_view why) const {
    say(fmt::format("node {}: {}", node, why));
    throw Ended{ExitCode::kRefused};
  }
  Result write(std::uint16_t index, const Bytes& value) const {
    return client.execute(tools::sdo_write(node, index, 1, value));
  }
  Result command(ProgramCommand command) const {
    return write(object::kProgramControl, {static_cast<std::uint8_t>(command)});
  }

  /// The number there when its bits of `mask` are `value`. A node that restarts or erases may be `silent`.
  std::uint32_t await(std::uint16_t index, std::uint32_t mask, std::uint32_t value,
                      bool silent = true) const {
    for (int pauses = 0; pauses < kMostPauses; ++pauses, pause()) {
      const Result response = client.execute(tools::sdo_read(node, index, 1));
      const auto number = static_cast<std::uint32_t>(load_little_endian(response.data));
      if (!silent || !is_silent(response)) check(response, fmt::format("{:04X}h:01", index));
      if (response.code == 0 && (number & mask) == value) return number;
    }
    fail(fmt::format("{:04X}h:01 has not changed within a minute", index));
  }
  std::uint32_t read(std::uint16_t index) const { return await(index, 0, 0, false); }
  std::uint32_t await_flash() const { return await(object::kFlashStatus, 1, 0) >> 1 & 0x7F; }

  /// A node that is restarting loses the command.
  void stop(int tries = 4) const {
    const Result done = command(ProgramCommand::kStop);
    if (!is_silent(done))
      check(done, "stop");
    else if (await(object::kProgramControl, 0, 0) != 0 && tries > 1)
      return stop(tries - 1);
    await(object::kProgramControl, 0xFF, 0);
  }

  void clear(int tries = 4) const {
    const Result done = command(ProgramCommand::kClear);
    if (done.code == 0) return void(await_flash());
    if (tries == 1) check(done, "clear");
    pause();
    clear(tries - 1);
  }

  /// Each piece is a download of its own.
  void download(std::span<const std::uint8_t> file) const {
    for (std::size_t at = 0; at < file.size(); at += regmap::kMaxDataBytes) {
      stop_if_interrupted();
      if (isatty(STDERR_FILENO) != 0) std::cerr << fmt::format("{} of {} bytes\r", at, file.size());
      const auto piece = file.subspan(at, std::min<std::size_t>(regmap::kMaxDataBytes, file.size() - at));
      const bool second = at == regmap::kMaxDataBytes;
      check(write(object::kProgramData, Bytes(piece.begin(), piece.end())),
            fmt::format("1F50h, byte {}{}", at, second ? "; does it take pieces of 128 bytes?" : ""));
    }
    const std::uint32_t error = await_flash(), expected = crc32(0, file);
    if (error != 0) fail(fmt::format("1F57h: flash error {}; the program is not started", error));
    if (const std::uint32_t crc = read(object::kProgramIdentification); crc != expected)
      fail(fmt::format("1F56h: CRC {:08X}h, the file has {:08X}h; it is not started", crc, expected));
  }
};

}  // namespace

void program(const Options& options) {
  const auto node = static_cast<std::uint8_t>(tools::parse_number(options.node, kMaxNode, "NODE"));
  if (node == 0) throw tools::UsageError("NODE 0: write 1..127");
  const std::string text = read_file(options.program);
  if (text.empty()) throw tools::UsageError(options.program + ": is empty");
  const Bytes file(text.begin(), text.end());
  window::Client client = connect(options);
  const Borrowed timeout(client, own::kSdoTimeout, sdo_timeout_of(options.timeout_ms));
  const Update update{client, node};
  const bool runs = update.read(object::kProgramControl) != 0;
  try {
    if (runs) update.stop();
    update.clear();
    update.download(file);
    update.check(update.command(ProgramCommand::kStart), "start");
    update.await(object::kProgramControl, 0xFF, 1);
  } catch (const window::Error& error) {
    throw window::Error(error.cause, fmt::format("{}; node {} may have no program now", error.what(), node));
  }
  if (options.json)
    fmt::print("{{\"node\": {}, \"bytes\": {}, \"crc\": {}}}\n", node, file.size(), crc32(0, file));
  else
    fmt::print("{} runs its new program: {} bytes, CRC {:08X}h\n", node, file.size(), crc32(0, file));
}

}  // namespace cbcan::ctl
