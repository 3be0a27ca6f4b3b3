// SPDX-License-Identifier: MIT
#include "io/modbus/modbus_rtu.hpp"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <utility>

#include "cbcan/regmap.hpp"

namespace cbcan::io {

namespace {

constexpr std::string_view kService = "rtu";
constexpr Time kRetryAfter = kSecond;

/// Adapters and the kernel deliver bytes in groups, with gaps between them. If a gap exceeds this, the frame is
/// lost and its master has one time-out.
constexpr std::uint32_t kGapUs = 200'000;

std::uint32_t counter(Time time) {
  return static_cast<std::uint32_t>(time);
}

/// A frame is the station address, the PDU and, in the response, the CRC.
void tell_exchange(adapters::ModbusUnit& unit, std::span<const std::uint8_t> request, std::string_view response) {
  const std::span all(reinterpret_cast<const std::uint8_t*>(response.data()), response.size());
  const bool has_pdu = all.size() > 3;
  const auto pdu = has_pdu ? all.subspan(1, all.size() - 3) : all.first(0);
  const bool refused = has_pdu && (pdu[0] & adapters::kExceptionBit) != 0;
  unit.on_exchange({0, 0, request[0], refused ? pdu[1] : std::uint8_t{0}, request.subspan(1), pdu});
}

}  // namespace

// ---- Frames

RtuSession::RtuSession(std::vector<adapters::ModbusUnit*> networks, const RtuServer::Settings& settings)
    : networks_(std::move(networks)),
      ranges_([this] {
        std::vector<RegisterRange> ranges;
        for (adapters::ModbusUnit* unit : networks_)
          ranges.push_back({0, unit->registers()});
        return ranges;
      }()),
      maps_([this] {
        std::vector<RegisterMap> maps;
        for (const RegisterRange& range : ranges_)
          maps.emplace_back(std::span(&range, 1));
        return maps;
      }()),
      server_(maps_, settings) {}

void RtuSession::receive(std::string_view bytes) {
  const Time now = Reactor::now();
  for (const char byte : bytes) {
    server_.on_byte(static_cast<std::uint8_t>(byte), counter(now));
    poll(now);
  }
}

void RtuSession::poll(Time now) {
  const std::uint32_t silence = server_.poll(counter(now));
  deadline_ = silence == 0 || silence == RtuServer::kNoRequest ? kNever : now + silence;
  if (silence == 0) execute();
}

void RtuSession::execute() {
  const std::size_t asked = server_.request_network();
  const std::span<adapters::ModbusUnit* const> meant = server_.is_broadcast()
                                                           ? std::span<adapters::ModbusUnit* const>(networks_)
                                                           : std::span(&networks_[asked], 1);
  const auto frame = networks_[asked]->listens() ? server_.request() : std::span<const std::uint8_t>();
  const std::vector<std::uint8_t> request(frame.begin(), frame.end());
  const bool diagnostics = server_.request_reads(regmap::kDiagnosticsFirst, regmap::kDiagnosticsWords + 1);
  for (adapters::ModbusUnit* const network : meant) {
    network->advance_due();
    if (diagnostics) network->on_diagnostics();
  }
  const auto response = server_.execute();
  const std::size_t before = unsent_.size();
  unsent_.append(response.begin(), response.end());
  const std::string_view sent = std::string_view(unsent_).substr(before);
  server_.on_sent();
  const RtuServer::Executed& executed = server_.executed();
  for (adapters::ModbusUnit* const network : meant) {
    if (!request.empty()) tell_exchange(*network, request, sent);
    network->on_writer(0, {executed.first, executed.count});
    network->on_request(executed.valid, {executed.first, executed.count});
  }
}

StreamServer::MakeSession rtu_over_tcp(std::vector<adapters::ModbusUnit*> networks, std::uint8_t station) {
  const RtuServer::Settings settings{.station = station, .silence_us = 0, .gap_us = kGapUs};
  return
      [networks = std::move(networks), settings] { return std::make_unique<RtuSession>(networks, settings); };
}

// ---- Serial port

ModbusSerial::ModbusSerial(Reactor& reactor, std::vector<adapters::ModbusUnit*> networks, window::Line line,
                           std::uint8_t station, Warn warn)
    : reactor_(reactor),
      line_(std::move(line)),
      warn_(std::move(warn)),
      session_(std::move(networks), {.station = station,
                                     .silence_us = rtu_silence_us(static_cast<std::uint32_t>(line_.baud)),
                                     .gap_us = kGapUs}) {
  open();
}

ModbusSerial::~ModbusSerial() {
  reactor_.forget(port_.get());
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
