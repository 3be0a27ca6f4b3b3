// SPDX-License-Identifier: MIT
#pragma once

#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <new>

#include "support/bench.hpp"

namespace cbcan::contract {

/// The 70 words, placed across a page boundary: R3700 ends a page, R3701 begins the next. With the first page
/// write-protected a write to R3700 traps, and the other words at that moment are kept: a second reader that sees
/// the new R3700 sees at least these. One at a time.
struct WatchedRegisters {
  WatchedRegisters() : page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) {
    void* const pages = mmap(nullptr, 2 * page_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (pages == MAP_FAILED) throw std::bad_alloc();
    first_page_ = static_cast<char*>(pages);
    words_ = new (first_page_ + page_ - sizeof(std::uint16_t)) test::Registers{};
  }
  ~WatchedRegisters() { munmap(first_page_, 2 * page_); }
  WatchedRegisters(const WatchedRegisters&) = delete;
  WatchedRegisters& operator=(const WatchedRegisters&) = delete;

  test::Registers& words() { return *words_; }

  /// True if `action` wrote to R3700; `seen` is then the window just before the first such write.
  template <class Action>
  bool watch(const Action& action, test::Registers& seen) {
    struct sigaction trap {};
    struct sigaction before {};
    trap.sa_sigaction = &WatchedRegisters::on_write;
    trap.sa_flags = SA_SIGINFO;
    watched = this;
    trapped_ = false;
    sigaction(SIGSEGV, &trap, &before);
    mprotect(first_page_, page_, PROT_READ);
    action();
    mprotect(first_page_, page_, PROT_READ | PROT_WRITE);
    sigaction(SIGSEGV, &before, nullptr);
    seen = seen_;
    return trapped_;
  }

 private:
  /// Repeats the write, which now succeeds; another kind of fault occurs again and ends the program.
  static void on_write(int number, siginfo_t* info, void* /*context*/) {
    if (info->si_addr != watched->words_->data()) {
      signal(number, SIG_DFL);
      return;
    }
    watched->seen_ = *watched->words_;
    watched->trapped_ = true;
    mprotect(watched->first_page_, watched->page_, PROT_READ | PROT_WRITE);
  }

  static inline WatchedRegisters* watched = nullptr;
  std::size_t page_;
  char* first_page_ = nullptr;
  test::Registers* words_ = nullptr;
  test::Registers seen_{};
  volatile bool trapped_ = false;
};

}  // namespace cbcan::contract
