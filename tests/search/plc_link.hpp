// SPDX-License-Identifier: MIT
#pragma once

/// A PLC's link to the plant around it: its registers by libmodbus, and a command connection that lets time
/// pass. Connections that faults close are made again.

#include <modbus/modbus.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace cbcan::test {

/// HOST and PORT of HOST:PORT in an environment variable.
inline std::pair<std::string, std::string> address_in(const char* variable) {
  const char* const text = std::getenv(variable);
  if (text == nullptr) throw std::runtime_error(std::string(variable) + " is not set");
  const std::string address = text;
  const std::size_t colon = address.rfind(':');
  return {address.substr(0, colon), address.substr(colon + 1)};
}

class PlcLink {
 public:
  PlcLink() {
    const auto [host, port] = address_in("CBCAN_CONTROL");
    addrinfo* found = nullptr;
    if (::getaddrinfo(host.c_str(), port.c_str(), nullptr, &found) != 0)
      throw std::runtime_error("getaddrinfo");
    control_ = ::socket(found->ai_family, SOCK_STREAM, 0);
    const bool connected = ::connect(control_, found->ai_addr, found->ai_addrlen) == 0;
    ::freeaddrinfo(found);
    if (!connected) throw std::runtime_error("no command connection");
  }
  ~PlcLink() { ::close(control_); }
  PlcLink(const PlcLink&) = delete;
  PlcLink& operator=(const PlcLink&) = delete;

  /// Executes a command; false = it was refused, or a wait has not ended.
  bool command(const std::string& line) {
    send(line + "\n");
    return response() != kError;
  }
  /// A scan in one exchange: writes the outputs, lets time pass, reads the inputs. What fails changes
  /// nothing.
  void scan(std::size_t out_first, std::span<const std::uint16_t> out, std::size_t in_first,
            std::span<std::uint16_t> in) {
    std::string lines = "modbus 10" + hex(out_first, 4) + hex(out.size(), 4) + hex(2 * out.size(), 2);
    for (const std::uint16_t word : out)
      lines += hex(word, 4);
    send(lines + "\npass 100ms\nmodbus 03" + hex(in_first, 4) + hex(in.size(), 4) + "\n");
    response();
    response();
    const std::string words = response();
    for (std::size_t i = 0; i < in.size() && words.starts_with("ok 03"); ++i)
      in[i] = static_cast<std::uint16_t>(std::stoul(words.substr(7 + 4 * i, 4), nullptr, 16));
  }
  void pass(const std::string& duration) { command("pass " + duration); }

  /// False: there is no response, and the request may have been executed.
  bool write(int first, const std::uint16_t* words, int count) {
    return connected() && lasts(modbus_write_registers(modbus_.get(), first, count, words) == count);
  }
  bool read(int first, std::uint16_t* words, int count) {
    return connected() && lasts(modbus_read_registers(modbus_.get(), first, count, words) == count);
  }

 private:
  static constexpr std::string_view kError = "error";

  static std::string hex(std::size_t number, std::size_t digits) {
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    std::string text;
    for (std::size_t i = digits; i-- != 0;)
      text += kDigits[number >> 4 * i & 15];
    return text;
  }
  void send(const std::string& lines) const {
    if (::write(control_, lines.data(), lines.size()) < 0) throw std::runtime_error("the plant is gone");
  }
  /// The last line of a response, or kError.
  std::string response() {
    for (std::string answer;;) {
      if (next_ == received_.size()) receive();
      const char c = received_[next_++];
      if (c != '\n') {
        answer += c;
        continue;
      }
      if (answer.starts_with("ok") || answer.starts_with("at ")) return answer;
      if (answer.starts_with("error:")) return std::string(kError);
      answer.clear();
    }
  }
  void receive() {
    received_.resize(1000);
    const ssize_t count = ::read(control_, received_.data(), received_.size());
    if (count <= 0) throw std::runtime_error("the plant is gone");
    received_.resize(static_cast<std::size_t>(count));
    next_ = 0;
  }

  bool connected() {
    if (modbus_) return true;
    const auto [host, port] = address_in("CBCAN_MODBUS");
    modbus_.reset(modbus_new_tcp_pi(host.c_str(), port.c_str()));
    modbus_set_response_timeout(modbus_.get(), 30, 0);
    return lasts(modbus_connect(modbus_.get()) == 0);
  }
  bool lasts(bool good) {
    if (!good) modbus_.reset();
    return good;
  }

  struct Free {
    void operator()(modbus_t* modbus) const {
      modbus_close(modbus);
      modbus_free(modbus);
    }
  };
  int control_ = -1;
  std::string received_;
  std::size_t next_ = 0;  ///< of received_
  std::unique_ptr<modbus_t, Free> modbus_;
};

}  // namespace cbcan::test
