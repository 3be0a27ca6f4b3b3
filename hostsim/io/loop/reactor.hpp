// SPDX-License-Identifier: MIT
#pragma once

/// One epoll instance, one thread, one timer. The owner's loop is
///
///     while (!signals.stop_requested()) {
///       everything.advance(reactor.time());
///       reactor.poll(everything.next_deadline());
///     }
///
/// The clock is read once a turn, so everything in a turn happens at the same time; see hold_at() for a loop
/// that is late.
///
/// Level-triggered: a callback may leave work undone and is called again. Callbacks must not block and must
/// not call poll().

#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "cbcan/time.hpp"
#include "io/loop/system.hpp"

namespace cbcan::io {

class Reactor {
 public:
  static constexpr std::uint32_t kReadable = EPOLLIN;
  static constexpr std::uint32_t kWritable = EPOLLOUT;
  /// Added to the above: called only when more has arrived since the last call (edge-triggered).
  static constexpr std::uint32_t kEdge = EPOLLET;
  /// Added for good: if the descriptor is ready, its callback is called between any two callbacks of others.
  static constexpr std::uint32_t kUrgent = 0x0100'0000;
  /// An error or a hang-up; always reported. The next read or write returns its cause.
  static constexpr std::uint32_t kBroken = EPOLLERR | EPOLLHUP;

  /// `ready`: any of the above.
  using Callback = std::function<void(std::uint32_t ready)>;

  /// Throws EnvironmentError when no descriptor is left.
  Reactor();
  ~Reactor() { clear_ended(); }
  Reactor(const Reactor&) = delete;
  Reactor& operator=(const Reactor&) = delete;

  /// Calls `callback` whenever `fd`, not watched yet, is ready for `interest`. The caller keeps the
  /// descriptor and calls forget() before closing it. False: it is a file, which is always ready and not
  /// watched. Throws EnvironmentError if the kernel cannot watch it.
  bool watch(int fd, std::uint32_t interest, Callback callback);

  /// Replaces the interest of a watched descriptor; 0 = only kBroken. False = the kernel refuses.
  bool change(int fd, std::uint32_t interest) { return control(EPOLL_CTL_MOD, fd, interest, find(fd)); }

  /// Ends the watch; the callback is not called again, even if the descriptor was ready already. May be
  /// called from any callback, including the one that it ends. Does nothing if `fd` is not watched.
  void forget(int fd);

  /// Waits until a descriptor is ready or it is `until` (kNever = no limit; a past time = no waiting), calls
  /// the callbacks of what is ready, and returns how many it called. A signal, or the `until` of an earlier
  /// call, may end the wait early.
  std::size_t poll(Time until);

  /// Calls the callbacks of kUrgent descriptors that are ready, each once. For long work outside of
  /// callbacks; not to be called by urgent callbacks.
  void poll_urgent();

  /// The time of this turn: now() at the end of the last wait, unless hold_at() limits it.
  const Time& time() const { return time_; }
  /// now() at the end of the last wait, without that limit.
  Time clock() const { return clock_; }
  /// Limits time() to `most` from now on; it never decreases. A loop that is late thus does one thing after
  /// the other, each at its time.
  void hold_at(Time most) {
    most_ = most;
    time_ = std::max(time_, std::min(clock_, most_));
  }
  /// Call it after long work that was not a turn.
  void read_clock() {
    clock_ = now();
    hold_at(most_);
  }

  /// CLOCK_MONOTONIC in microseconds; read nowhere else in the project.
  static Time now();

  /// Added to now(), gives wall-clock time (microseconds since 1970).
  static Time wall_offset();

 private:
  struct Watch {
    Callback callback;
    bool urgent = false;
    bool live = true;
    std::uint64_t served = 0;       ///< turn of the last call, if urgent
    std::unique_ptr<Watch> next{};  ///< in the list of ended watches, so that forget() allocates nothing
  };

  Watch* find(int fd) const;
  bool control(int operation, int fd, std::uint32_t interest, Watch* watch) const;
  void clear_ended();
  void set_timer(Time until);

  Descriptor epoll_;
  Descriptor urgent_;  ///< a second epoll: urgent descriptors are in both
  Descriptor timer_;
  std::uint64_t turn_ = 0;
  Time timer_at_ = kNever;  ///< kNever = not running
  Time clock_ = now();
  Time time_ = clock_;
  Time most_ = kNever;                           ///< limit of time_
  std::vector<std::unique_ptr<Watch>> watches_;  ///< by descriptor
  std::array<epoll_event, 512> events_{};  ///< many: each ready descriptor is served before any is served twice
  std::unique_ptr<Watch> ended_;  ///< list of those forgotten in this turn: events may still point at them
};

/// Raises the process's soft limit of open descriptors to the hard one; never lowers it.
void raise_descriptor_limit();

}  // namespace cbcan::io
