// SPDX-License-Identifier: MIT
#pragma once

/// One epoll instance, one thread, one timer. The owner's loop is
///
///     while (!signals.stop_requested()) {
///       everything.advance(reactor.time());
///       reactor.run_once(everything.next_deadline());
///     }
///
/// The clock is read once a turn: all that is done in it is done at one time, see hold_at() for who is late.
///
/// Level-triggered: a callback may leave work undone and is called again. Callbacks must not block and must
/// not call run_once().

#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "cbcan/time.hpp"
#include "io/loop/descriptor.hpp"

namespace cbcan::io {

class Reactor {
 public:
  static constexpr std::uint32_t kReadable = 0x01;
  static constexpr std::uint32_t kWritable = 0x04;
  /// Besides the above: only when more has come since, for owners that look again without being told.
  static constexpr std::uint32_t kEdge = 0x8000'0000;
  /// Likewise, once for all: who is ready has a turn between any two callbacks of others, however many
  /// those are.
  static constexpr std::uint32_t kUrgent = 0x0100'0000;
  /// An error or a hang-up; reported whether asked for or not. The next read or write says what it is.
  static constexpr std::uint32_t kBroken = 0x18;

  /// What the descriptor is ready for: any of the above.
  using Callback = std::function<void(std::uint32_t ready)>;

  /// Throws EnvironmentError when the kernel has no descriptor left.
  Reactor();
  ~Reactor();
  Reactor(const Reactor&) = delete;
  Reactor& operator=(const Reactor&) = delete;

  /// Calls `callback` whenever `fd`, not watched yet, is ready for `interest`. The descriptor stays the
  /// caller's, who forgets it before closing it. False: it is a file, which is ready always and not watched.
  /// Throws EnvironmentError if the kernel cannot watch it.
  bool watch(int fd, std::uint32_t interest, Callback callback);

  /// Replaces the interest of a watched descriptor; 0 = only kBroken. False = the kernel refuses.
  bool change(int fd, std::uint32_t interest);

  /// Ends the watch; from now on the callback is not called, also not for what was ready already. May be
  /// called from any callback, also from the one that it ends. Not watched: nothing happens.
  void forget(int fd);

  /// Waits until something is ready or it is `until` (kNever = without limit; a time gone by = just looks),
  /// calls the callbacks of what is ready, and returns how many it called. A signal may end the wait early,
  /// and so may the time of an earlier call.
  std::size_t run_once(Time until);

  /// Calls those of kUrgent that are ready, each once. For what takes long outside of callbacks; not to be
  /// called by what is urgent.
  void poll_urgent();

  /// The time of this turn: now() at the end of the last wait, unless it is held.
  const Time& time() const { return time_; }
  /// now() then, held or not.
  Time clock() const { return clock_; }
  /// Until it is told otherwise time() goes no further, nor back: who is late does one thing after the other,
  /// each at its time.
  void hold_at(Time most) {
    most_ = most;
    time_ = std::max(time_, std::min(clock_, most_));
  }
  /// After something long that was no turn.
  void read_clock() {
    clock_ = now();
    hold_at(most_);
  }

  /// CLOCK_MONOTONIC in microseconds: the project's only reading of it.
  static Time now();

  /// What makes wall-clock time (microseconds since 1970) of now()'s.
  static Time wall_offset();

 private:
  struct Watch {
    Callback callback;
    bool urgent = false;
    bool live = true;
    std::uint64_t served = 0;       ///< in which turn, of those that are urgent
    std::unique_ptr<Watch> next{};  ///< of those that have ended: to forget takes no memory
  };

  Watch* find(int fd) const;
  bool control(int operation, int fd, std::uint32_t interest, Watch* watch) const;
  void clear_ended();
  void set_timer(Time until);

  Descriptor epoll_;
  Descriptor urgent_;  ///< an epoll too: those are in both
  Descriptor timer_;
  std::uint64_t turn_ = 0;
  Time timer_at_ = kNever;  ///< kNever = it is not running
  Time clock_ = now();
  Time time_ = clock_;
  Time most_ = kNever;                           ///< that time_ may be
  std::vector<std::unique_ptr<Watch>> watches_;  ///< by descriptor
  std::array<epoll_event, 512> events_{};  ///< everybody who is ready has a turn before anybody has a second
  std::unique_ptr<Watch> ended_;  ///< forgotten during this turn, a list: events may still point at them
};

/// Raises the soft limit of open descriptors to the hard one. The process's; never lowers it.
void raise_descriptor_limit();

}  // namespace cbcan::io
