// SPDX-License-Identifier: MIT
#include "io/sockets/stream_listener.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include "io/errors.hpp"

namespace cbcan::io {

namespace {

sockaddr_un to_sockaddr(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  return address;
}

Descriptor new_socket() {
  return Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
}

/// True: the file of a socket on which no program listens. Connecting to any other file is refused too, hence
/// the check of its type.
bool is_abandoned(const sockaddr_un& address) {
  struct stat file {};
  if (lstat(address.sun_path, &file) != 0 || !S_ISSOCK(file.st_mode)) return false;
  const Descriptor probe = new_socket();
  return connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 &&
         errno == ECONNREFUSED;
}

Descriptor try_listen(const sockaddr_un& address) {
  Descriptor socket = new_socket();
  if (!socket || bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(socket.get(), SOMAXCONN) != 0)
    return {};
  return socket;
}

Descriptor listen_unix(const std::string& where, const std::string& path) {
  const sockaddr_un address = to_sockaddr(path);
  Descriptor socket = try_listen(address);
  if (!socket && errno == EADDRINUSE) {
    if (!is_abandoned(address))
      throw EnvironmentError(where +
                             "in use: another program listens there, or it is a file; write another path");
    unlink(path.c_str());
    socket = try_listen(address);
  }
  if (!socket)
    throw EnvironmentError(where + reason(errno) + "; write a path in a folder that can be written");
  return socket;
}

/// A new link may get the inode number of a former one: the target distinguishes them.
OwnFile::Identity identity_of(const std::string& path) {
  struct stat file {};
  std::error_code not_a_link;
  if (lstat(path.c_str(), &file) != 0) return {};
  return {file.st_dev, file.st_ino, std::filesystem::read_symlink(path, not_a_link)};
}

}  // namespace

OwnFile::OwnFile(std::string path) : path_(std::move(path)), file_(identity_of(path_)) {}

OwnFile::~OwnFile() {
  if (!path_.empty() && identity_of(path_) == file_) unlink(path_.c_str());
}

StreamListener::StreamListener(std::string_view service, const StreamAddress& address) : address_(address) {
  if (!address.path.empty()) {
    socket_ = listen_unix(std::string(service) + " " + to_string(address) + ": ", address.path);
    file_ = OwnFile(address.path);
  } else {
    Listener listener = listen_tcp(service, address.tcp);
    socket_ = std::move(listener.socket);
    address_.tcp = std::move(listener.address);
  }
}

}  // namespace cbcan::io
