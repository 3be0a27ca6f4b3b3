// SPDX-License-Identifier: MIT
// The order in which words shared with another context are read and written (docs/reference/contract.md).
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <new>

#include "modbus/line.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using test::Bytes;
using test::hex;

/// The register file, placed so that R3700 ends a page. While the pages up to there are protected, the first
/// access to R3700 traps and `other` runs just before it, like another context. One at a time.
struct TrappedRegisters {
  using Words = std::array<std::uint16_t, regmap::kRegisterFileWords>;

  TrappedRegisters() {
    pages_ = static_cast<char*>(
        mmap(nullptr, 4 * page_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    if (pages_ == MAP_FAILED) throw std::bad_alloc();
    words = new (pages_ + 2 * page_ - 2 * (regmap::kWindowFirst + 1)) Words{};
  }
  ~TrappedRegisters() { munmap(pages_, 4 * page_); }
  TrappedRegisters(const TrappedRegisters&) = delete;
  TrappedRegisters& operator=(const TrappedRegisters&) = delete;

  /// `protection`: the accesses that stay allowed up to R3700. True: R3700 was accessed.
  bool run(int protection, const std::function<void()>& action, const std::function<void()>& other) {
    struct sigaction trap {};
    struct sigaction before {};
    trap.sa_sigaction = &TrappedRegisters::on_access;
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

  Words* words;

 private:
  /// Repeats the access, which now succeeds; another kind of fault occurs again and ends the program.
  static void on_access(int number, siginfo_t* info, void* /*context*/) {
    if (info->si_addr != &(*watched->words)[regmap::kExecuteFlag]) {
      signal(number, SIG_DFL);
      return;
    }
    mprotect(watched->pages_, 2 * watched->page_, PROT_READ | PROT_WRITE);
    watched->trapped_ = true;
    (*watched->other_)();
  }

  static inline TrappedRegisters* watched = nullptr;
  std::size_t page_ = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  char* pages_ = nullptr;
  const std::function<void()>* other_ = nullptr;
  volatile bool trapped_ = false;
};

Bytes executed(RtuServer& server, const Bytes& request) {
  constexpr std::uint32_t kTime = 10'000;
  for (const std::uint8_t byte : request)
    server.on_byte(byte, kTime);
  if (server.poll(2 * kTime) != 0) return {};
  const std::span<const std::uint8_t> response = server.execute();
  Bytes copy(response.begin(), response.end());
  server.on_sent();
  return copy;
}

/// The request writes 13BFh, 0042h, 6411h, 0001h to R3701..R3704, and then CA0Eh to R3700.
void check_flag_comes_last(const Bytes& request) {
  TrappedRegisters registers;
  // The first word and the others are in different ranges.
  const std::array<RegisterRange, 2> ranges{
      {{0, std::span(*registers.words).first(3701)}, {3701, std::span(*registers.words).subspan(3701)}}};
  const RegisterMap map(ranges);
  RtuServer server({&map, 1}, {});
  std::array<std::uint16_t, 5> seen{};
  const auto look = [&] {
    for (std::size_t i = 0; i < seen.size(); ++i)
      seen[i] = (*registers.words)[regmap::kWindowFirst + i];
  };
  REQUIRE(registers.run(
      PROT_READ, [&] { executed(server, request); }, look));
  CHECK(seen == std::array<std::uint16_t, 5>{0, 0x13BF, 0x0042, 0x6411, 0x0001});
  CHECK((*registers.words)[regmap::kExecuteFlag] == 0xCA0E);
}

TEST_CASE("RTU: one FC 16 stores R3700 after all that comes behind it") {
  check_flag_comes_last(hex("01 10 0E 74 00 05 0A CA 0E 13 BF 00 42 64 11 00 01 6B DC"));
}

TEST_CASE("RTU: one FC 23 stores R3700 after all that comes behind it") {
  check_flag_comes_last(hex("01 17 0E 75 00 01 0E 74 00 05 0A CA 0E 13 BF 00 42 64 11 00 01 9A 71"));
}

TEST_CASE("RTU: a read loads R3700 before all that comes behind it") {
  TrappedRegisters registers;
  // The first word and the others are in different ranges.
  const std::array<RegisterRange, 2> ranges{
      {{0, std::span(*registers.words).first(3701)}, {3701, std::span(*registers.words).subspan(3701)}}};
  const RegisterMap map(ranges);
  RtuServer server({&map, 1}, {});
  (*registers.words)[regmap::kExecuteFlag] = 0xCA0E;
  Bytes response;
  // Another context ends a transaction at the last moment: R3700 then shows its result, so the rest must too.
  const auto finish = [&] {
    (*registers.words)[regmap::kDataSize] = 2;
    (*registers.words)[regmap::kData] = 0x012C;
    (*registers.words)[regmap::kExecuteFlag] = 0;
  };
  const Bytes read = hex("01 03 0E 74 00 07 46 FA");
  REQUIRE(registers.run(
      PROT_NONE, [&] { response = executed(server, read); }, finish));
  CHECK(response == hex("01 03 0E 00 00 00 00 00 00 00 00 00 00 00 02 01 2C 4E 98"));
}

}  // namespace
}  // namespace cbcan
