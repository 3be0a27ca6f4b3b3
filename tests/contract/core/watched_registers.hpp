// SPDX-License-Identifier: MIT
#pragma once

#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <new>

namespace cbcan::contract {

/// `kWords` registers, placed so that register `kWatched` ends a page. While the pages up to there are protected,
/// the first access to it traps and `other` runs just before the access, like another context. One at a time.
template <std::size_t kWords, std::size_t kWatched>
struct WatchedRegisters {
  using Words = std::array<std::uint16_t, kWords>;

  WatchedRegisters() {
    void* const pages = mmap(nullptr, 4 * page_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (pages == MAP_FAILED) throw std::bad_alloc();
    pages_ = static_cast<char*>(pages);
    words_ = new (pages_ + 2 * page_ - sizeof(std::uint16_t) * (kWatched + 1)) Words{};
  }
  ~WatchedRegisters() { munmap(pages_, 4 * page_); }
  WatchedRegisters(const WatchedRegisters&) = delete;
  WatchedRegisters& operator=(const WatchedRegisters&) = delete;

  Words& words() { return *words_; }

  /// Runs `action`. `protection`: the accesses that stay allowed up to the watched register. True: it was accessed.
  bool run(int protection, const std::function<void()>& action, const std::function<void()>& other) {
    struct sigaction trap {};
    struct sigaction before {};
    trap.sa_sigaction = &WatchedRegisters::on_access;
    trap.sa_flags = SA_SIGINFO;
    watched = this;
    other_ = &other;
    trapped_ = false;
    sigaction(SIGSEGV, &trap, &before);
    mprotect(pages_, 2 * page_, protection);
    action();
    mprotect(pages_, 2 * page_, PROT_READ | PROT_WRITE);
    sigaction(SIGSEGV, &before, nullptr);
    return trapped_;
  }

 private:
  /// Repeats the access, which now succeeds; another kind of fault occurs again and ends the program.
  static void on_access(int number, siginfo_t* info, void* /*context*/) {
    if (info->si_addr != &(*watched->words_)[kWatched]) {
      signal(number, SIG_DFL);
      return;
    }
    mprotect(watched->pages_, 2 * watched->page_, PROT_READ | PROT_WRITE);
    watched->trapped_ = true;
    (*watched->other_)();
  }

  static inline WatchedRegisters* watched = nullptr;
  std::size_t page_ = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  char* pages_ = nullptr;
  Words* words_ = nullptr;
  const std::function<void()>* other_ = nullptr;
  volatile bool trapped_ = false;
};

}  // namespace cbcan::contract
