// SPDX-License-Identifier: MIT
#include "io/loop/line_input.hpp"

#include <fcntl.h>
#include <unistd.h>

#include "io/errors.hpp"
#include "support/catch.hpp"

namespace cbcan::io {
namespace {

struct Pipe {
  Pipe() {
    int ends[2];
    REQUIRE(pipe2(ends, O_CLOEXEC) == 0);
    out = Descriptor(ends[0]);
    in = Descriptor(ends[1]);
  }
  void write(std::string_view text) {
    REQUIRE(::write(in.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }
  Descriptor out;
  Descriptor in;
};

TEST_CASE("lines from a pipe, when they are whole") {
  Reactor reactor;
  Pipe pipe;
  LineInput input(reactor, pipe.out.get(), "standard input");
  CHECK(reactor.poll(0) == 0);
  CHECK(input.next_deadline() == kNever);
  pipe.write("one\ntw");
  CHECK(reactor.poll(0) == 1);
  CHECK(input.take() == "one");
  CHECK(input.take() == std::nullopt);
  pipe.write("o\n\n");
  reactor.poll(0);
  input.poll();
  CHECK(input.take() == "two");
  CHECK(input.take() == "");
  CHECK_FALSE(input.ended());
  pipe.write("last");
  pipe.in.reset();
  while (reactor.poll(0) != 0) {
  }
  CHECK_FALSE(input.ended());
  CHECK(input.take() == "last");
  CHECK(input.ended());
}

TEST_CASE("lines without a consumer are not read") {
  Reactor reactor;
  Pipe pipe;
  LineInput input(reactor, pipe.out.get(), "standard input");
  pipe.write(std::string(3 * 4096, '\n'));
  for (int turn = 0; turn < 10; ++turn)
    reactor.poll(0);
  int lines = 0;
  while (input.take())
    ++lines;
  CHECK(lines == 4096);
  while (reactor.poll(0) != 0)
    while (input.take())
      ++lines;
  CHECK(lines == 3 * 4096);
}

TEST_CASE("lines from a file, which cannot wake the reactor") {
  Reactor reactor;
  const Descriptor file(open("/tmp", O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  REQUIRE(::write(file.get(), "one\ntwo\n", 8) == 8);
  REQUIRE(lseek(file.get(), 0, SEEK_SET) == 0);
  LineInput input(reactor, file.get(), "standard input");
  CHECK(input.next_deadline() == 0);
  input.poll();
  CHECK(input.take() == "one");
  input.poll();
  CHECK(input.next_deadline() == kNever);
  CHECK_FALSE(input.ended());
  CHECK(input.take() == "two");
  CHECK(input.ended());
}

TEST_CASE("a line without end is refused") {
  Reactor reactor;
  Pipe pipe;
  LineInput input(reactor, pipe.out.get(), "standard input");
  pipe.write(std::string(1000, 'x') + "\n");
  reactor.poll(0);
  CHECK(input.take()->size() == 1000);
  pipe.write(std::string(1001, 'x'));
  CHECK_THROWS_AS(reactor.poll(0), UsageError);
}

TEST_CASE("an input that cannot be read is reported") {
  Reactor reactor;
  const Descriptor write_only(open("/tmp", O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600));
  LineInput input(reactor, write_only.get(), "standard input");
  CHECK_THROWS_AS(input.poll(), EnvironmentError);
}

}  // namespace
}  // namespace cbcan::io
