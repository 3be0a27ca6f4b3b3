// SPDX-License-Identifier: MIT
#include "window/connection.hpp"

#include <fcntl.h>
#include <modbus.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace cbcan::window {

namespace {

constexpr std::uint8_t kReadRegisters = 3;
constexpr std::uint8_t kWriteRegisters = 16;
constexpr std::uint8_t kWriteAndReadRegisters = 23;
constexpr std::uint8_t kException = 0x80;
constexpr std::size_t kHead = 2;  ///< unit ID and function code

void append(std::vector<std::uint8_t>& bytes, std::size_t word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

std::uint8_t function_of(const Request& request) {
  if (request.words.empty()) return kReadRegisters;
  return request.count == 0 ? kWriteRegisters : kWriteAndReadRegisters;
}

/// Unit ID and PDU (Modbus Application Protocol V1.1b3, 6.3, 6.12 and 6.17), which are the same over TCP and a
/// serial line.
std::vector<std::uint8_t> bytes_of(std::uint8_t unit, const Request& request) {
  std::vector<std::uint8_t> bytes{unit, function_of(request)};
  if (request.count > 0) {
    append(bytes, request.read_address);
    append(bytes, request.count);
  }
  if (request.words.empty()) return bytes;
  append(bytes, request.write_address);
  append(bytes, request.words.size());
  bytes.push_back(static_cast<std::uint8_t>(2 * request.words.size()));
  for (const std::uint16_t word : request.words)
    append(bytes, word);
  return bytes;
}

/// None if `bytes`, starting with the unit ID, are no response to that request.
std::optional<Response> response_in(std::span<const std::uint8_t> bytes, std::uint8_t unit,
                                    const Request& request) {
  constexpr std::size_t kExceptionSize = kHead + 1, kWriteSize = kHead + 4;
  const std::uint8_t function = function_of(request);
  const std::size_t data = 2u * request.count;
  if (bytes.size() < kExceptionSize || bytes[0] != unit) return std::nullopt;
  if (bytes[1] == (function | kException) && bytes.size() == kExceptionSize && bytes[2] != 0)
    return Response{.exception = bytes[2]};
  if (bytes[1] != function || bytes.size() != (data == 0 ? kWriteSize : kHead + 1 + data))
    return std::nullopt;
  if (data != 0 && bytes[2] != data) return std::nullopt;
  Response response;
  for (std::size_t at = kHead + 1; at < kHead + 1 + data; at += 2)
    response.words.push_back(static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]));
  return response;
}

constexpr std::array<speed_t, kBaudRates.size()> kSpeeds{B1200,  B2400,   B4800,   B9600,   B19200, B38400,
                                                         B57600, B115200, B230400, B460800, B921600};

/// 3.5 characters of 11 bits; above 19200 baud 1750 us (2.5.1.1).
Time silence(int baud) {
  return baud > 19'200 ? 1750 : (38'500'000 + baud - 1) / baud;
}

std::string why_not_opened(int error) {
  switch (error) {
    case ENOENT:
      return "no such device; is the adapter plugged in? `ls /dev/serial/by-id` lists those that are";
    case EACCES:
      return "no permission; serial devices are for the group dialout: `sudo usermod -aG dialout $USER`, "
             "then log in again";
    case ENOTTY:
    case EISDIR: return "not a serial device";
    case EWOULDBLOCK: return "another program uses it";
    default: return std::strerror(error);
  }
}

tcflag_t flags_of(char parity) {
  if (parity == 'N') return CSTOPB;
  return parity == 'O' ? PARENB | PARODD : PARENB;
}

/// 0, or an error number.
int set_up(int port, speed_t speed, char parity) {
  termios line{};
  if (tcgetattr(port, &line) != 0) return ENOTTY;
  if (flock(port, LOCK_EX | LOCK_NB) != 0) return errno;
  cfmakeraw(&line);
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | PARODD | CRTSCTS);
  line.c_cflag |= CLOCAL | CREAD | flags_of(parity);
  if (parity != 'N') line.c_iflag |= INPCK;
  cfsetspeed(&line, speed);
  // A pseudo-terminal has no parity; glibc reports that as EINVAL from the second call on.
  if (tcsetattr(port, TCSANOW, &line) != 0 && errno != EINVAL) return errno;
  tcflush(port, TCIOFLUSH);
  return 0;
}

class RtuConnection final : public Connection {
 public:
  RtuConnection(const Line& line, const Timing& timing)
      : Connection(line.device, timing, modbus_new_rtu("unused", 9600, 'N', 8, 2), silence(line.baud)),
        line_(line) {}

  void poll(Time now) override {
    if (state_ != State::kOff || !attempt_due(now)) return;
    const int opened = open_line(line_);
    if (opened < 0) return end(why_not_opened(-opened), now);
    descriptor_ = opened;
    connected();
  }

 private:
  const char* fault_of(Come come, bool late) const override {
    if (!late) return nullptr;
    return come.empty()
               ? "no response"
               : "what it answers is no response; are baud rate, parity and unit those of the device?";
  }

  const char* loss_by(int /*error*/) const override { return "the port is gone"; }

  Line line_;
};

/// Transaction number 0, protocol 0, then the length of the rest.
constexpr std::size_t kZeros = 4;
constexpr std::size_t kHeader = 6;

std::size_t length_of(std::span<const std::uint8_t> come) {
  return kHeader + (std::size_t{come[kZeros]} << 8 | come[kZeros + 1]);
}

class TcpConnection final : public Connection {
 public:
  TcpConnection(std::string host, int port, const Timing& timing)
      : Connection(host + ":" + std::to_string(port), timing, modbus_new_tcp(nullptr, 0)),
        host_(std::move(host)),
        port_(std::to_string(port)),
        addresses_(nullptr, freeaddrinfo) {}

  void poll(Time now) override {
    switch (state_) {
      case State::kOff:
        if (attempt_due(now)) connect(now);
        return;
      case State::kConnecting: return look_at_attempt(now);
      case State::kOn: return look_for_end(now);
    }
  }

 private:
  /// libmodbus checks neither the transaction number of a response nor its protocol and length.
  Come framed_in(Come come) override {
    if (come.size() < kHeader || come.size() != length_of(come)) return {};
    const bool ours = std::ranges::all_of(come.first(kZeros), [](std::uint8_t byte) { return byte == 0; });
    return ours ? Connection::framed_in(come) : Come{};
  }

  const char* fault_of(Come come, bool late) const override {
    const bool grows =
        come.size() < kHeader || (length_of(come) <= kLongestFrame && come.size() < length_of(come));
    if (!grows) return "what it answers is no Modbus";
    return late ? "no response" : nullptr;
  }

  const char* loss_by(int error) const override {
    return error == 0 ? "closed by the other side" : std::strerror(error);
  }

  void connect(Time now) {
    addrinfo wanted{};
    wanted.ai_socktype = SOCK_STREAM;
    wanted.ai_flags = AI_NUMERICSERV;
    addrinfo* found = nullptr;
    const int error = getaddrinfo(host_.c_str(), port_.c_str(), &wanted, &found);
    if (error != 0) return end(gai_strerror(error), now);
    addresses_.reset(found);
    try_address(found, now);
  }

  void try_address(const addrinfo* address, Time now) {
    next_ = address->ai_next;
    descriptor_ = socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (descriptor_ < 0) return address_failed(std::strerror(errno), now);
    const int on = 1;
    setsockopt(descriptor_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    state_ = State::kConnecting;
    until_ = now + timing_.response_timeout;
    if (::connect(descriptor_, address->ai_addr, address->ai_addrlen) != 0 && errno != EINPROGRESS)
      return address_failed(std::strerror(errno), now);
    look_at_attempt(now);
  }

  /// A name may have several addresses.
  void address_failed(const char* why, Time now) {
    if (next_ == nullptr) return end(why, now);
    close();
    try_address(next_, now);
  }

  void look_at_attempt(Time now) {
    pollfd attempt{descriptor_, POLLOUT, 0};
    if (::poll(&attempt, 1, 0) != 1) {
      if (now >= until_) address_failed("no response", now);
      return;
    }
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) return address_failed(std::strerror(error), now);
    connected();
  }

  void look_for_end(Time now) {
    if (!response_due() && read(now) && come() > 0) end("it sends an unrequested response", now);
  }

  std::string host_;
  std::string port_;
  std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses_;  ///< of the attempt
  const addrinfo* next_ = nullptr;                            ///< tried if this one fails
};

}  // namespace

static_assert(kLongestFrame == MODBUS_MAX_ADU_LENGTH);

/// libmodbus reads from a pair of sockets what a Connection has received, with the shortest time-out that it
/// takes. From the descriptor itself it cannot: what it has read of an incomplete frame it forgets, and its
/// select() takes no descriptor from FD_SETSIZE on.
Framing::Framing(_modbus* context) : context_(context, modbus_free) {
  if (context == nullptr || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair_.data()) != 0)
    throw Error(Error::Cause::kNoDescriptor, std::strerror(errno));
  modbus_set_response_timeout(context, 0, 1);
  modbus_set_byte_timeout(context, 0, 0);
  if (pair_[0] < FD_SETSIZE) return;
  for (const int socket : pair_)
    ::close(socket);
  throw Error(Error::Cause::kNoDescriptor,
              "libmodbus needs a descriptor below 1024, and none is free; close some");
}

Framing::~Framing() {
  for (const int socket : pair_)
    ::close(socket);
}

bool Framing::send(int descriptor, Bytes request) {
  modbus_set_socket(context_.get(), descriptor);
  modbus_set_slave(context_.get(), request.front());
  modbus_flush(context_.get());
  return modbus_send_raw_request(context_.get(), request.data(), static_cast<int>(request.size())) >= 0;
}

Framing::Bytes Framing::response_in(Bytes received) {
  if (received.empty()) return {};
  modbus_set_socket(context_.get(), pair_[0]);
  ::send(pair_[1], received.data(), received.size(), 0);
  const int size = modbus_receive_confirmation(context_.get(), frame_.data());
  const auto whole = static_cast<std::size_t>(size);
  if (size <= 0 || whole != received.size()) {
    ::recv(pair_[0], frame_.data(), frame_.size(), MSG_DONTWAIT);  // what libmodbus has left
    return {};
  }
  const auto header = static_cast<std::size_t>(modbus_get_header_length(context_.get()));
  const std::size_t checksum = header == 1 ? 2 : 0;
  return Bytes(frame_).subspan(header - 1, whole - checksum - (header - 1));
}

Connection::Connection(std::string place, const Timing& timing, _modbus* context, Time silence)
    : timing_(timing), framing_(context), silence_(silence), place_(std::move(place)), pause_(timing.pause) {}

short Connection::events() const {
  if (state_ == State::kConnecting) return POLLOUT;
  return due_ ? POLLIN : short{0};
}

void Connection::send(std::uint8_t unit, const Request& request, Time now) {
  size_ = 0;
  if (!framing_.send(descriptor_, bytes_of(unit, request))) return end(modbus_strerror(errno), now);
  due_ = Due{unit, request, now + timing_.response_timeout};
}

std::optional<Response> Connection::receive(Time now) {
  if (!due_ || !read(now)) return std::nullopt;
  const Come come(buffer_.data(), size_);
  if (std::optional<Response> response = response_in(framed_in(come), due_->unit, due_->request)) {
    due_.reset();
    size_ = 0;
    pause_ = timing_.pause;
    until_ = now + silence_;
    return response;
  }
  if (const char* const why = fault_of(come, now >= due_->until)) end(why, now);
  return std::nullopt;
}

/// More bytes than the longest frame are left unread.
bool Connection::read(Time now) {
  if (size_ == buffer_.size()) return true;
  const ssize_t count = ::read(descriptor_, buffer_.data() + size_, buffer_.size() - size_);
  if (count > 0) size_ += static_cast<std::size_t>(count);
  const bool lost = count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR);
  if (lost) end(loss_by(count == 0 ? 0 : errno), now);
  return !lost;
}

void Connection::connected() {
  state_ = State::kOn;
  size_ = 0;
  until_ = 0;
  reason_.clear();
}

void Connection::close() {
  if (descriptor_ < 0) return;
  if (on_close) on_close(descriptor_);
  ::close(descriptor_);
  descriptor_ = -1;
}

void Connection::end(const std::string& why, Time now) {
  close();
  state_ = State::kOff;
  due_.reset();
  ++ends_;
  until_ = now + pause_;
  pause_ = std::min(2 * pause_, timing_.longest_pause);
  reason_ = why;
}

int open_line(const Line& line) {
  const auto* const baud = std::ranges::find(kBaudRates, line.baud);
  if (baud == kBaudRates.end()) return -EINVAL;
  const int port = ::open(line.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (port < 0) return -errno;
  const int error = set_up(port, kSpeeds[static_cast<std::size_t>(baud - kBaudRates.begin())], line.parity);
  if (error == 0) return port;
  ::close(port);
  return -error;
}

std::unique_ptr<Connection> rtu_connection(const Line& line, const Timing& timing) {
  return std::make_unique<RtuConnection>(line, timing);
}

std::unique_ptr<Connection> tcp_connection(std::string host, int port, const Timing& timing) {
  return std::make_unique<TcpConnection>(std::move(host), port, timing);
}

}  // namespace cbcan::window
