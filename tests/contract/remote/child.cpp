// SPDX-License-Identifier: MIT
#include "contract/remote/child.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

namespace cbcan::contract {

namespace {

constexpr int kPatienceMs = 60'000;

struct Pipe {
  Pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    out = io::Descriptor(ends[0]);
    in = io::Descriptor(ends[1]);
  }
  io::Descriptor out;
  io::Descriptor in;
};

/// In the new process; only system calls from here on.
[[noreturn]] void become(char* const* arguments, int input, int output) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  dup2(input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

Child::Child(const std::vector<std::string>& command) {
  std::vector<char*> arguments;
  for (const std::string& word : command)
    arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  Pipe to, from;
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("no process for " + command[0]);
  if (pid_ == 0) become(arguments.data(), to.out.get(), from.in.get());
  input_ = std::move(to.in);
  output_ = std::move(from.out);
}

Child::~Child() {
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void Child::say(const std::string& line) {
  const std::string text = line + "\n";
  if (write(input_.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    throw std::runtime_error("the program does not read its standard input");
}

std::string Child::hear() {
  std::size_t end = 0;
  while ((end = heard_.find('\n')) == std::string::npos) {
    std::array<char, 4096> part;
    wait_readable(output_.get(), "the program");
    const ssize_t count = read(output_.get(), part.data(), part.size());
    if (count <= 0) throw std::runtime_error("the program has ended; its last words: " + heard_);
    heard_.append(part.data(), static_cast<std::size_t>(count));
  }
  std::string line = heard_.substr(0, end);
  heard_.erase(0, end + 1);
  return line;
}

void wait_readable(int fd, const std::string& who) {
  pollfd wanted{fd, POLLIN, 0};
  if (poll(&wanted, 1, kPatienceMs) <= 0) throw std::runtime_error(who + " has said nothing for a minute");
}

}  // namespace cbcan::contract
