// SPDX-License-Identifier: MIT
#include "io/loop/workers.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>
#include <vector>

#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"

namespace cbcan::io {

namespace {

/// In front of each result.
struct Header {
  std::size_t number;
  std::size_t size;
};

void write_all(int to, const void* data, std::size_t size) {
  for (const char* next = static_cast<const char*>(data); size > 0;) {
    const ssize_t written = ::write(to, next, size);
    if (written < 0) ::_exit(1);
    next += written;
    size -= static_cast<std::size_t>(written);
  }
}

/// A copy of this process, and what has come from it.
struct Worker {
  pid_t process = 0;
  Descriptor results;
  std::string received{};

  /// False: there is nothing more.
  bool receive() {
    std::array<char, 65536> part;
    const ssize_t count = ::read(results.get(), part.data(), part.size());
    if (count > 0) received.append(part.data(), static_cast<std::size_t>(count));
    return count > 0;
  }
  bool take(Header& header, std::string& result) {
    if (received.size() < sizeof header) return false;
    std::memcpy(&header, received.data(), sizeof header);
    if (received.size() - sizeof header < header.size) return false;
    result = received.substr(sizeof header, header.size);
    received.erase(0, sizeof header + header.size);
    return true;
  }
};

Worker start(std::size_t first, std::size_t count, std::size_t step,
             const std::function<std::string(std::size_t)>& work) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw EnvironmentError("processes: " + reason(errno));
  Descriptor read_end(ends[0]);
  const Descriptor write_end(ends[1]);
  const pid_t process = ::fork();
  if (process < 0) throw EnvironmentError("processes: " + reason(errno));
  if (process > 0) return {process, std::move(read_end)};
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (std::size_t number = first; number < count; number += step) {
    const std::string result = work(number);
    const Header header{number, result.size()};
    write_all(write_end.get(), &header, sizeof header);
    write_all(write_end.get(), result.data(), result.size());
  }
  ::_exit(0);
}

}  // namespace

void work_in_processes(std::size_t count, std::size_t processes,
                       const std::function<std::string(std::size_t number)>& work,
                       const std::function<void(std::size_t number, std::string result)>& done,
                       const std::function<std::string()>& lost) {
  if (processes <= 1) {
    for (std::size_t number = 0; number < count; ++number)
      done(number, work(number));
    return;
  }
  std::vector<Worker> workers;
  std::vector<pollfd> waiting;
  for (std::size_t i = 0; i < std::min(processes, count); ++i) {
    workers.push_back(start(i, count, processes, work));
    waiting.push_back({workers.back().results.get(), POLLIN, 0});
  }
  std::vector<bool> is_done(count);
  for (std::size_t left = workers.size(); left > 0;) {
    if (::poll(waiting.data(), waiting.size(), -1) < 0) continue;
    for (std::size_t i = 0; i < workers.size(); ++i) {
      if (waiting[i].revents == 0) continue;
      const bool more = workers[i].receive();
      Header header{};
      for (std::string result; workers[i].take(header, result);) {
        is_done[header.number] = true;
        done(header.number, std::move(result));
      }
      if (more) continue;
      waiting[i].fd = -1;
      --left;
      ::waitpid(workers[i].process, nullptr, 0);
    }
  }
  for (std::size_t number = 0; number < count; ++number)
    if (!is_done[number]) done(number, lost());
}

}  // namespace cbcan::io
