// SPDX-License-Identifier: MIT
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "cbcan/window.hpp"

namespace cbcan::window {

namespace {

using Cause = Error::Cause;

class Control {
 public:
  Control(const std::string& host, const std::string& port) : Control(host + ":" + port) {
    addrinfo wanted{};
    wanted.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (const int error = getaddrinfo(host.c_str(), port.c_str(), &wanted, &found); error != 0)
      lost(gai_strerror(error));
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> address(found, freeaddrinfo);
    descriptor_ = socket(address->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (connect(descriptor_, address->ai_addr, address->ai_addrlen) != 0) lost(std::strerror(errno));
  }
  ~Control() { ::close(descriptor_); }
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;

  void pass(std::chrono::milliseconds duration) {
    const std::string line = "pass " + std::to_string(duration.count()) + "ms\n";
    if (::send(descriptor_, line.data(), line.size(), MSG_NOSIGNAL) < 0) lost(std::strerror(errno));
    if (const std::string response = next_line(); response.rfind("at ", 0) != 0) lost(response);
  }

 private:
  explicit Control(std::string place) : place_(std::move(place)) {}

  std::string next_line() {
    std::string line;
    std::array<char, 256> come{};
    while (line.empty() || line.back() != '\n') {
      const ssize_t size = ::recv(descriptor_, come.data(), come.size(), 0);
      if (size <= 0) lost("the connection is lost");
      line.append(come.data(), static_cast<std::size_t>(size));
    }
    return line;
  }

  [[noreturn]] void lost(const std::string& why) const {
    throw Error(Cause::kNoConnection, "no connection to CBCAN_CONTROL " + place_ + ": " + why);
  }

  std::string place_;
  int descriptor_ = -1;
};

}  // namespace

std::function<void(std::chrono::milliseconds)> plant_time(const char* control) {
  const std::string text = control == nullptr ? "" : control;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || text.rfind("unix:", 0) == 0 || text.rfind("pty:", 0) == 0) return {};
  const bool is_v6 = text.front() == '[';
  const auto access =
      std::make_shared<Control>(text.substr(is_v6, colon - 2 * is_v6), text.substr(colon + 1));
  return [access](std::chrono::milliseconds duration) { access->pass(duration); };
}

}  // namespace cbcan::window
