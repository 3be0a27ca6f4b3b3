// SPDX-License-Identifier: MIT
#include "io/loop/reactor.hpp"

#include <sys/resource.h>
#include <sys/timerfd.h>
#include <time.h>

#include <cerrno>
#include <utility>

namespace cbcan::io {

namespace {

constexpr std::size_t kUrgentEvents = 64;
constexpr long kNanosecondsPerMicrosecond = 1000;

[[noreturn]] void fail(const char* what) {
  throw EnvironmentError(std::string("reactor: ") + what + ": " + reason(errno));
}

Time time_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<Time>(time.tv_sec) * kSecond +
         static_cast<Time>(time.tv_nsec) / kNanosecondsPerMicrosecond;
}

timespec to_timespec(Time time) {
  return {static_cast<time_t>(time / kSecond),
          static_cast<long>(time % kSecond) * kNanosecondsPerMicrosecond};
}

}  // namespace

Reactor::Reactor()
    : epoll_(epoll_create1(EPOLL_CLOEXEC)),
      urgent_(epoll_create1(EPOLL_CLOEXEC)),
      timer_(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)) {
  if (!epoll_ || !urgent_ || !timer_) fail("epoll");
  epoll_event event{.events = EPOLLIN | EPOLLET, .data = {.ptr = nullptr}};
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, timer_.get(), &event) != 0) fail("timer");
}

Reactor::Watch* Reactor::find(int fd) const {
  const auto index = static_cast<std::size_t>(fd);
  return fd >= 0 && index < watches_.size() ? watches_[index].get() : nullptr;
}

bool Reactor::control(int operation, int fd, std::uint32_t interest, Watch* watch) const {
  epoll_event event{.events = interest & ~kUrgent, .data = {.ptr = watch}};
  return epoll_ctl(epoll_.get(), operation, fd, &event) == 0 &&
         (!watch->urgent || epoll_ctl(urgent_.get(), operation, fd, &event) == 0);
}

bool Reactor::watch(int fd, std::uint32_t interest, Callback callback) {
  const auto index = static_cast<std::size_t>(fd);
  if (index >= watches_.size()) watches_.resize(index + 1);
  watches_[index] = std::make_unique<Watch>(Watch{std::move(callback), (interest & kUrgent) != 0});
  if (control(EPOLL_CTL_ADD, fd, interest, watches_[index].get())) return true;
  const int error = errno;
  epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, fd, nullptr);
  watches_[index].reset();
  errno = error;
  if (errno != EPERM) fail("watch");
  return false;
}

void Reactor::forget(int fd) {
  if (find(fd) == nullptr) return;
  auto& watch = watches_[static_cast<std::size_t>(fd)];
  control(EPOLL_CTL_DEL, fd, 0, watch.get());
  watch->live = false;
  watch->next = std::move(ended_);
  ended_ = std::move(watch);
}

/// One by one: destroying a long list at once would be a deep recursion.
void Reactor::clear_ended() {
  while (ended_)
    ended_ = std::move(ended_->next);
}

/// Deadlines are postponed often, a running timer never: it expires too early then, and is set again.
void Reactor::set_timer(Time until) {
  const itimerspec at{{}, to_timespec(until)};
  timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &at, nullptr);
  timer_at_ = until;
}

std::size_t Reactor::poll(Time until) {
  const bool waits = until > clock_;
  if (waits && until < timer_at_) set_timer(until);
  const int count =
      epoll_wait(epoll_.get(), events_.data(), static_cast<int>(events_.size()), waits ? -1 : 0);
  read_clock();
  ++turn_;
  std::size_t called = 0;
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events_[static_cast<std::size_t>(i)];
    auto* const watch = static_cast<Watch*>(event.data.ptr);
    if (watch == nullptr) timer_at_ = kNever;
    if (watch == nullptr || !watch->live || watch->served == turn_) continue;
    watch->callback(event.events);
    if (!watch->urgent) poll_urgent();
    ++called;
  }
  if (ended_) clear_ended();
  return called;
}

void Reactor::poll_urgent() {
  std::array<epoll_event, kUrgentEvents> events;
  const int count = epoll_wait(urgent_.get(), events.data(), kUrgentEvents, 0);
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    auto* const watch = static_cast<Watch*>(event.data.ptr);
    if (!watch->live) continue;
    watch->served = turn_;
    watch->callback(event.events);
  }
}

Time Reactor::now() {
  return time_of(CLOCK_MONOTONIC);
}

Time Reactor::wall_offset() {
  return time_of(CLOCK_REALTIME) - now();
}

void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace cbcan::io
