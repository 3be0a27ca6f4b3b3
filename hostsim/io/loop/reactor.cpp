// SPDX-License-Identifier: MIT
#include "io/loop/reactor.hpp"

#include <poll.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>

#include <array>
#include <cerrno>
#include <utility>

#include "io/errors.hpp"

namespace cbcan::io {

namespace {

static_assert(Reactor::kReadable == EPOLLIN && Reactor::kWritable == EPOLLOUT);
static_assert(Reactor::kEdge == std::uint32_t{EPOLLET});
static_assert(Reactor::kBroken == (EPOLLERR | EPOLLHUP));

constexpr std::size_t kEventsPerTurn = 64;
constexpr long kNanosecondsPerMicrosecond = 1000;

using Events = std::array<epoll_event, kEventsPerTurn>;

[[noreturn]] void fail(const char* what) {
  throw EnvironmentError(std::string("reactor: ") + what + ": " + reason(errno));
}

Time read_clock(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<Time>(time.tv_sec) * kSecond +
         static_cast<Time>(time.tv_nsec / kNanosecondsPerMicrosecond);
}

timespec to_timespec(Time time) {
  return {static_cast<time_t>(time / kSecond),
          static_cast<long>(time % kSecond) * kNanosecondsPerMicrosecond};
}

int wait(int epoll, Events& events, Time until) {
  const int room = static_cast<int>(events.size());
  if (until == kNever) return epoll_wait(epoll, events.data(), room, -1);
  const Time now = Reactor::now();
  if (until <= now) return epoll_wait(epoll, events.data(), room, 0);
  const timespec left = to_timespec(until - now);
  const int count = epoll_pwait2(epoll, events.data(), room, &left, nullptr);
  if (count >= 0 || errno != ENOSYS) return count;
  // Linux before 5.11: two calls do the same.
  pollfd any{epoll, POLLIN, 0};
  ppoll(&any, 1, &left, nullptr);
  return epoll_wait(epoll, events.data(), room, 0);
}

}  // namespace

Reactor::Reactor() : epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  if (!epoll_) fail("epoll");
  prctl(PR_SET_TIMERSLACK, kNanosecondsPerMicrosecond, 0, 0, 0);
}

Reactor::~Reactor() {
  clear_ended();
}

Reactor::Watch* Reactor::find(int fd) const {
  const auto index = static_cast<std::size_t>(fd);
  return fd >= 0 && index < watches_.size() ? watches_[index].get() : nullptr;
}

bool Reactor::watch(int fd, std::uint32_t interest, Callback callback) {
  const auto index = static_cast<std::size_t>(fd);
  if (index >= watches_.size()) watches_.resize(index + 1);
  watches_[index] = std::make_unique<Watch>(Watch{std::move(callback)});
  epoll_event event{.events = interest, .data = {.ptr = watches_[index].get()}};
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event) == 0) return true;
  watches_[index].reset();
  if (errno != EPERM) fail("watch");
  return false;
}

bool Reactor::change(int fd, std::uint32_t interest) {
  epoll_event event{.events = interest, .data = {.ptr = find(fd)}};
  return epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, fd, &event) == 0;
}

void Reactor::forget(int fd) {
  if (find(fd) == nullptr) return;
  auto& watch = watches_[static_cast<std::size_t>(fd)];
  epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, fd, nullptr);
  watch->live = false;
  watch->next = std::move(ended_);
  ended_ = std::move(watch);
}

/// One by one: a long list would be a deep recursion.
void Reactor::clear_ended() {
  while (ended_)
    ended_ = std::move(ended_->next);
}

std::size_t Reactor::run_once(Time until) {
  Events events;
  const int count = wait(epoll_.get(), events, until);
  std::size_t called = 0;
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    Watch& watch = *static_cast<Watch*>(event.data.ptr);
    if (!watch.live) continue;
    watch.callback(event.events);
    ++called;
  }
  clear_ended();
  return called;
}

Time Reactor::now() {
  return read_clock(CLOCK_MONOTONIC);
}

Time Reactor::wall_offset() {
  return read_clock(CLOCK_REALTIME) - now();
}

void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace cbcan::io
