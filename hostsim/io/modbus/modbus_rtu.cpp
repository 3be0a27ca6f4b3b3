// SPDX-License-Identifier: MIT
#include "io/modbus/modbus_rtu.hpp"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

namespace cbcan::io {

namespace {

constexpr std::string_view kService = "rtu";
constexpr Time kRetryAfter = kSecond;

}  // namespace

ModbusSerial::ModbusSerial(Reactor& reactor, std::vector<protocols::ModbusUnit*> networks, window::Line line,
                           std::uint8_t station, Warn warn)
    : reactor_(reactor),
      line_(std::move(line)),
      warn_(std::move(warn)),
      session_(std::move(networks), Reactor::now,
               {.station = station,
                .silence_us = rtu_silence_us(static_cast<std::uint32_t>(line_.baud)),
                .gap_us = protocols::kRtuGapUs}) {
  open();
}

void ModbusSerial::open() {
  port_ = open_serial(kService, line_);
  reactor_.watch(port_.get(), Reactor::kReadable | Reactor::kUrgent, [this](std::uint32_t ready) {
    const bool writable_alone = ready == Reactor::kWritable;
    if ((!writable_alone && !receive()) || !send()) lose();
  });
}

void ModbusSerial::poll(Time now) {
  if (!port_ && now >= retry_at_) {
    try {
      open();
      warn_(std::string(kService) + " " + line_.device + ": is there again");
    } catch (const EnvironmentError&) {
      retry_at_ = now + kRetryAfter;
    }
  }
  session_.poll(now);
  if (port_ && !send()) lose();
}

bool ModbusSerial::receive() {
  std::array<char, RtuServer::kMaxFrame> bytes;
  const ssize_t count = ::read(port_.get(), bytes.data(), bytes.size());
  if (count <= 0) return count < 0 && is_temporary(errno);
  session_.receive({bytes.data(), static_cast<std::size_t>(count)});
  return true;
}

bool ModbusSerial::send() {
  const std::string_view unsent = session_.unsent();
  if (unsent.empty()) return true;
  const ssize_t count = ::write(port_.get(), unsent.data(), unsent.size());
  if (count < 0 && !is_temporary(errno)) return false;
  if (count > 0) session_.sent(static_cast<std::size_t>(count));
  reactor_.change(port_.get(),
                  session_.unsent().empty() ? Reactor::kReadable : Reactor::kReadable | Reactor::kWritable);
  return true;
}

void ModbusSerial::lose() {
  session_.sent(session_.unsent().size());
  reactor_.forget(port_.get());
  port_.reset();
  retry_at_ = Reactor::now() + kRetryAfter;
  warn_(std::string(kService) + " " + line_.device +
        ": is gone; plug it in again, it is looked for every second");
}

}  // namespace cbcan::io
