// SPDX-License-Identifier: MIT
#include "io/loop/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <string_view>

namespace cbcan::io {

namespace {

constexpr int kIgnored[] = {SIGPIPE, SIGXFSZ};

bool has_terminal() {
  return static_cast<bool>(Descriptor(::open("/dev/tty", O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)));
}

constexpr int kCannotExecute = 126;
constexpr int kNotFound = 127;
constexpr int kSignalled = 128;

int open_process(pid_t process) {
  return static_cast<int>(::syscall(SYS_pidfd_open, process, 0));
}

int code_of(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status);
}

/// Makes `group` the only one that Ctrl-C at the terminal signals.
void give_terminal(pid_t group) {
  ::signal(SIGTTOU, SIG_IGN);
  ::tcsetpgrp(STDIN_FILENO, group);
  ::signal(SIGTTOU, SIG_DFL);
}

[[noreturn]] void become(const std::vector<std::string>& command, const std::vector<std::string>& environment,
                         const std::function<void()>& prepare) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const bool in_foreground = ::tcgetpgrp(STDIN_FILENO) == ::getpgrp();
  ::setpgid(0, 0);
  if (in_foreground) give_terminal(::getpid());
  prepare();
  for (const std::string& line : environment)
    ::putenv(const_cast<char*>(line.c_str()));  // NOLINT: it is not written to
  std::vector<char*> words;
  for (const std::string& word : command)
    words.push_back(const_cast<char*>(word.c_str()));  // NOLINT: it is not written to
  words.push_back(nullptr);
  ::execvp(words[0], words.data());
  const int error = errno;
  std::fprintf(stderr, "cbcan-sim: %s: %s\n", words[0], std::strerror(error));
  ::_exit(error == ENOENT ? kNotFound : kCannotExecute);
}

/// Orphaned descendants of the command become children of the guard, whatever their process group.
void kill_the_rest() {
  do {
    std::FILE* const children = std::fopen("/proc/thread-self/children", "r");
    int child = 0;
    while (children != nullptr && std::fscanf(children, "%d", &child) == 1)
      ::kill(child, SIGKILL);
    if (children != nullptr) std::fclose(children);
  } while (::waitpid(-1, nullptr, 0) > 0);
}

/// Runs until the command, or the program at the other end of the line, has ended.
[[noreturn]] void guard(int line, pid_t command) {
  pollfd waiting[]{{line, POLLIN, 0}, {open_process(command), POLLIN, 0}};
  int status = SIGKILL;
  while (::waitpid(command, &status, WNOHANG) == 0) {
    if (::poll(waiting, 2, -1) < 0 || waiting[0].revents == 0) continue;
    unsigned char number = SIGKILL;
    const bool alive = ::read(line, &number, 1) == 1;
    if (::kill(-command, number) != 0) ::kill(command, number);  // not yet a group of its own
    if (!alive) ::waitpid(command, &status, 0);
  }
  ::kill(-command, SIGKILL);
  kill_the_rest();
  ::_exit(code_of(status));
}

[[noreturn]] void run_guard(int line, const std::vector<std::string>& command,
                            const std::vector<std::string>& environment,
                            const std::function<void()>& prepare) {
  sigset_t all;
  sigset_t former;
  sigfillset(&all);
  ::sigprocmask(SIG_SETMASK, &all, &former);
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  const pid_t child = ::fork();
  if (child == 0) {
    ::sigprocmask(SIG_SETMASK, &former, nullptr);
    become(command, environment, prepare);
  }
  if (child < 0) ::_exit(kCannotExecute);
  guard(line, child);
}

constexpr std::string_view kReady = "READY=1";
constexpr char kAbstract = '@';  ///< represents the leading 0 of names outside the file system

/// Returns 0 or an errno.
int send_to(std::string_view name) {
  sockaddr_un address{};
  if (name.size() >= sizeof address.sun_path) return ENAMETOOLONG;
  address.sun_family = AF_UNIX;
  std::ranges::copy(name, address.sun_path);
  if (name.starts_with(kAbstract)) address.sun_path[0] = '\0';
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  const Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const bool sent = socket && ::sendto(socket.get(), kReady.data(), kReady.size(), 0,
                                       reinterpret_cast<const sockaddr*>(&address), size) >= 0;
  return sent ? 0 : errno;
}

}  // namespace

StopSignals::StopSignals(Reactor& reactor) : reactor_(reactor), had_terminal_(has_terminal()) {
  sigset_t wanted;
  sigemptyset(&wanted);
  sigaddset(&wanted, SIGINT);
  sigaddset(&wanted, SIGTERM);
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaddset(&wanted, SIGHUP);
  signals_ = Descriptor(signalfd(-1, &wanted, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!signals_) throw EnvironmentError("signals: " + reason(errno));
  sigprocmask(SIG_BLOCK, &wanted, &former_mask_);
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  for (std::size_t i = 0; i < std::size(kIgnored); ++i)
    sigaction(kIgnored[i], &ignore, &former_[i]);
  reactor_.watch(signals_.get(), Reactor::kReadable, [this](std::uint32_t) { poll(); });
}

StopSignals::~StopSignals() {
  reactor_.forget(signals_.get());
  restore();
}

void StopSignals::restore() const {
  for (std::size_t i = 0; i < std::size(kIgnored); ++i)
    sigaction(kIgnored[i], &former_[i], nullptr);
  sigprocmask(SIG_SETMASK, &former_mask_, nullptr);
}

bool StopSignals::poll() {
  signalfd_siginfo signal{};
  while (::read(signals_.get(), &signal, sizeof signal) == sizeof signal) {
    if (on_signal_)
      on_signal_(static_cast<int>(signal.ssi_signo));
    else if (signal.ssi_signo != SIGHUP || had_terminal_ != has_terminal() || !on_hangup_())
      stop_requested_ = true;
  }
  return stop_requested_;
}

ChildProcess::ChildProcess(Reactor& reactor, const std::vector<std::string>& command,
                           const std::vector<std::string>& environment, const std::function<void()>& prepare)
    : reactor_(reactor), in_foreground_(::tcgetpgrp(STDIN_FILENO) == ::getpgrp()) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw EnvironmentError(command[0] + ": " + reason(errno));
  Descriptor read_end(ends[0]);
  line_ = Descriptor(ends[1]);
  guard_ = ::fork();
  if (guard_ == 0) {
    line_.reset();
    run_guard(read_end.get(), command, environment, prepare);
  }
  if (guard_ > 0) ended_ = Descriptor(open_process(guard_));
  if (!ended_) throw EnvironmentError(command[0] + ": " + reason(errno));
  reactor_.watch(ended_.get(), Reactor::kReadable, [this](std::uint32_t) { reap(WNOHANG); });
}

ChildProcess::~ChildProcess() {
  line_.reset();
  if (!exit_code_) reap(0);
}

void ChildProcess::signal(int number) {
  const auto byte = static_cast<unsigned char>(number);
  if (::write(line_.get(), &byte, 1) != 1) return;  // the guard has ended, reap() follows
}

void ChildProcess::reap(int options) {
  int status = 0;
  if (::waitpid(guard_, &status, options) != guard_) return;
  exit_code_ = code_of(status);
  reactor_.forget(ended_.get());
  if (in_foreground_) give_terminal(::getpgrp());
}

void tell_ready(const Warn& warn) {
  const char* const name = std::getenv("NOTIFY_SOCKET");
  if (name == nullptr) return;
  if (const int error = send_to(name); error != 0)
    warn("service manager: NOTIFY_SOCKET=" + std::string(name) + ": " + reason(error) +
         "; it does not hear that cbcan-sim serves");
}

}  // namespace cbcan::io
