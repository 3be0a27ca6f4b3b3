// SPDX-License-Identifier: MIT
#include "io/loop/reactor.hpp"

#include <fcntl.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>

#include "io/loop/process.hpp"
#include "io/loop/system.hpp"
#include "support/catch.hpp"

namespace cbcan::io {
namespace {

/// A descriptor that can be made readable.
struct Event {
  Event() : descriptor_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) { REQUIRE(descriptor_); }
  int fd() const { return descriptor_.get(); }
  void raise() { REQUIRE(eventfd_write(fd(), 1) == 0); }
  void clear() {
    eventfd_t value = 0;
    REQUIRE(eventfd_read(fd(), &value) == 0);
  }

 private:
  Descriptor descriptor_;
};

TEST_CASE("a callback is called while its descriptor is ready for the present interest, and says for what") {
  Reactor reactor;
  Event event;
  std::uint32_t seen = 0;
  reactor.watch(event.fd(), Reactor::kReadable, [&](std::uint32_t ready) { seen = ready; });
  CHECK(reactor.poll(0) == 0);
  event.raise();
  CHECK(reactor.poll(kNever) == 1);
  CHECK(seen == Reactor::kReadable);
  CHECK(reactor.poll(0) == 1);
  event.clear();
  CHECK(reactor.poll(0) == 0);
  reactor.change(event.fd(), Reactor::kWritable);
  event.raise();
  CHECK(reactor.poll(0) == 1);
  CHECK(seen == Reactor::kWritable);
  reactor.change(event.fd(), 0);
  CHECK(reactor.poll(0) == 0);
}

TEST_CASE("what is urgent has its turn between any two others, and one that it has had is over") {
  Reactor reactor;
  Event urgent;
  Event others[3];
  std::string order;
  for (int i = 0; i < 3; ++i)
    reactor.watch(others[i].fd(), Reactor::kReadable, [&, i](std::uint32_t) {
      order += static_cast<char>('0' + i);
      others[i].clear();
      if (i != 2) urgent.raise();
    });
  reactor.watch(urgent.fd(), Reactor::kReadable | Reactor::kUrgent, [&](std::uint32_t ready) {
    order += ready == Reactor::kReadable ? 'u' : '?';
    if (ready == Reactor::kReadable) urgent.clear();  // fails when it is not readable
  });
  for (Event& other : others)
    other.raise();
  reactor.poll(0);
  CHECK(order == "0u1u2");
  urgent.raise();
  reactor.poll_urgent();
  reactor.poll_urgent();
  CHECK(order == "0u1u2u");
  urgent.raise();
  others[2].raise();
  reactor.poll(0);  // ready in the same turn as the other one
  CHECK(order.size() == 8);
  reactor.change(urgent.fd(), Reactor::kWritable);
  reactor.poll_urgent();
  CHECK(order.back() == '?');
  reactor.forget(urgent.fd());
  urgent.raise();
  reactor.poll_urgent();
  CHECK(reactor.poll(0) == 0);
}

TEST_CASE("a wait ends when it was asked to, to the microsecond and never before") {
  Reactor reactor;
  for (const Time wait : {Time{1}, Time{250}, Time{1700}}) {
    const Time until = Reactor::now() + wait;
    CHECK(reactor.poll(until) == 0);
    CHECK(Reactor::now() >= until);
  }
}

TEST_CASE("an earlier wait takes the place of a later one, and time stands still in each turn") {
  Reactor reactor;
  Event event;
  Time seen = 0;
  reactor.watch(event.fd(), Reactor::kReadable, [&](std::uint32_t) {
    event.clear();
    while (Reactor::now() == reactor.time()) {
    }
    seen = reactor.time();
  });
  const Time late = reactor.time() + 10 * kSecond;
  event.raise();
  CHECK(reactor.poll(late) == 1);
  CHECK(seen == reactor.time());
  const Time soon = Reactor::now() + 300;
  CHECK(reactor.poll(soon) == 0);
  CHECK(reactor.time() >= soon);
  CHECK(reactor.time() < late);
}

TEST_CASE("a callback may forget itself and close its descriptor") {
  Reactor reactor;
  std::optional<Event> event(std::in_place);
  int calls = 0;
  // Too large for std::function's internal buffer, so that the sanitizer detects use of freed memory.
  const std::array<std::uint64_t, 16> payload{7};
  reactor.watch(event->fd(), Reactor::kReadable, [&, payload](std::uint32_t) {
    reactor.forget(event->fd());
    event.reset();
    calls += static_cast<int>(payload[0]);
  });
  event->raise();
  CHECK(reactor.poll(0) == 1);
  CHECK(reactor.poll(0) == 0);
  CHECK(calls == 7);
}

TEST_CASE("what a callback forgets is not called any more, although it was ready already") {
  Reactor reactor;
  Event first;
  Event second;
  int calls = 0;
  const auto forget_both = [&](std::uint32_t) {
    ++calls;
    reactor.forget(first.fd());
    reactor.forget(second.fd());
  };
  reactor.watch(first.fd(), Reactor::kReadable, forget_both);
  reactor.watch(second.fd(), Reactor::kReadable, forget_both);
  first.raise();
  second.raise();
  CHECK(reactor.poll(0) == 1);
  CHECK(calls == 1);
}

TEST_CASE("a new watch under a number that was just closed does not get the old one's events") {
  Reactor reactor;
  std::optional<Event> events[2]{std::optional<Event>(std::in_place), std::optional<Event>(std::in_place)};
  int old_calls = 0;
  int new_calls = 0;
  const auto replace_other = [&](std::size_t other) {
    ++old_calls;
    const int number = events[other]->fd();
    reactor.forget(number);
    events[other].reset();
    events[other].emplace();
    REQUIRE(events[other]->fd() == number);
    reactor.watch(number, Reactor::kReadable, [&](std::uint32_t) { ++new_calls; });
  };
  reactor.watch(events[0]->fd(), Reactor::kReadable, [&](std::uint32_t) { replace_other(1); });
  reactor.watch(events[1]->fd(), Reactor::kReadable, [&](std::uint32_t) { replace_other(0); });
  events[0]->raise();
  events[1]->raise();
  CHECK(reactor.poll(0) == 1);
  CHECK(old_calls == 1);
  CHECK(new_calls == 0);
}

TEST_CASE("a callback may add so many watches that the table grows") {
  Reactor reactor;
  Event event;
  std::vector<Descriptor> more;
  reactor.watch(event.fd(), Reactor::kReadable, [&](std::uint32_t) {
    for (int i = 0; i < 600; ++i) {
      more.emplace_back(dup(event.fd()));
      reactor.watch(more.back().get(), Reactor::kReadable, [](std::uint32_t) {});
    }
    reactor.forget(event.fd());
  });
  event.raise();
  CHECK(reactor.poll(0) == 1);
  CHECK(reactor.poll(0) == 512);
  for (const Descriptor& descriptor : more)
    reactor.forget(descriptor.get());
}

TEST_CASE("forgetting what is not watched does nothing; watching what does not exist is an error") {
  Reactor reactor;
  reactor.forget(-1);
  reactor.forget(12345);
  CHECK_THROWS_AS(reactor.watch(12345, Reactor::kReadable, [](std::uint32_t) {}), EnvironmentError);
  reactor.forget(12345);
  const Descriptor file(::open("/proc/self/exe", O_RDONLY | O_CLOEXEC));
  CHECK_FALSE(reactor.watch(file.get(), Reactor::kReadable, [](std::uint32_t) {}));
}

TEST_CASE("signals are as before when StopSignals goes, and SIGPIPE and SIGXFSZ are ignored meanwhile") {
  const auto handler_of = [](int signal) {
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    return action.sa_handler;
  };
  const auto terminate_blocked = [] {
    sigset_t mask;
    sigprocmask(SIG_SETMASK, nullptr, &mask);
    return sigismember(&mask, SIGTERM) == 1;
  };
  Reactor reactor;
  std::signal(SIGPIPE, SIG_DFL);
  std::signal(SIGXFSZ, SIG_DFL);
  {
    const StopSignals signals(reactor);
    CHECK(handler_of(SIGPIPE) == SIG_IGN);
    CHECK(handler_of(SIGXFSZ) == SIG_IGN);
    CHECK(terminate_blocked());
  }
  CHECK(handler_of(SIGPIPE) == SIG_DFL);
  CHECK(handler_of(SIGXFSZ) == SIG_DFL);
  CHECK_FALSE(terminate_blocked());
}

TEST_CASE("the descriptor limit is raised to the hard one") {
  rlimit before{};
  REQUIRE(getrlimit(RLIMIT_NOFILE, &before) == 0);
  const rlimit lower{before.rlim_max - 1, before.rlim_max};
  REQUIRE(setrlimit(RLIMIT_NOFILE, &lower) == 0);
  raise_descriptor_limit();
  rlimit after{};
  REQUIRE(getrlimit(RLIMIT_NOFILE, &after) == 0);
  CHECK(after.rlim_cur == before.rlim_max);
  REQUIRE(setrlimit(RLIMIT_NOFILE, &before) == 0);
}

}  // namespace
}  // namespace cbcan::io
