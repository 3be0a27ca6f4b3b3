// SPDX-License-Identifier: MIT
#pragma once

/// A PLC's link to the plant around it: its registers by libmodbus, and a command connection that lets time
/// pass. Connections that faults close are made again.

#include <modbus/modbus.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>
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
    const std::string text = line + "\n";
    if (::write(control_, text.data(), text.size()) < 0) throw std::runtime_error("the plant is gone");
    for (std::string answer;;) {
      char c = 0;
      if (::read(control_, &c, 1) != 1) throw std::runtime_error("the plant is gone");
      if (c != '\n') {
        answer += c;
      } else {
        if (answer.starts_with("ok") || answer.starts_with("at ")) return true;
        if (answer.starts_with("error:")) return false;
        answer.clear();
      }
    }
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
  std::unique_ptr<modbus_t, Free> modbus_;
};

}  // namespace cbcan::test
