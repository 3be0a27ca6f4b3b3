// SPDX-License-Identifier: MIT
#include "io/loop/stop_signals.hpp"

#include <sys/signalfd.h>

#include <cerrno>
#include <iterator>

#include "io/loop/system.hpp"

namespace cbcan::io {

namespace {

constexpr int kIgnored[] = {SIGPIPE, SIGXFSZ};

}  // namespace

StopSignals::StopSignals(Reactor& reactor) : reactor_(reactor) {
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
    else
      stop_requested_ = true;
  }
  return stop_requested_;
}

}  // namespace cbcan::io
