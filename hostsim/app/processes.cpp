// SPDX-License-Identifier: MIT
#include "app/processes.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "app/explore.hpp"
#include "app/simulator.hpp"
#include "app/told_json.hpp"
#include "io/loop/reactor.hpp"

namespace cbcan::app {

namespace {

using explore::Run;
using explore::Told;
using nlohmann::json;

constexpr Time kWallLimit = 60 * kSecond;  ///< of a run on this machine's clock

/// False: there is no more.
bool read_some(int from, std::string& text) {
  char part[65536];
  const ssize_t count = ::read(from, part, sizeof part);
  if (count > 0) text.append(part, static_cast<std::size_t>(count));
  return count > 0;
}

/// A run without a whole result was too slow.
Told told_in(const std::string& text) {
  const json parsed = json::parse(text, nullptr, false);
  if (!parsed.is_discarded()) return parsed.get<Told>();
  Told told;
  told.result.verdict = explore::Verdict::kNotJudged;
  return told;
}

}  // namespace

void Processes::all(std::size_t count, const std::function<Run(std::size_t)>& make,
                    const std::function<bool()>& wanted,
                    const std::function<void(std::size_t, const Told&)>& ended) {
  for (std::size_t next = 0; next < count || !processes_.empty();) {
    if (!wanted()) next = count;
    for (; next < count && processes_.size() < at_a_time(start_.search); ++next)
      begin(next, make(next));
    wait(ended);
  }
}

void Processes::begin(std::size_t number, const Run& run) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw io::EnvironmentError("pipe: " + io::reason(errno));
  io::Descriptor write_end(ends[1]);
  io::Descriptor read_end(ends[0]);
  const pid_t id = ::fork();
  if (id < 0) throw io::EnvironmentError("fork: " + io::reason(errno));
  if (id == 0) be(run, write_end.get());
  processes_.push_back({id, std::move(read_end), number, io::Reactor::now()});
}

/// In the new process.
void Processes::be(const Run& run, int to) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // the guard of the command then ends it
  for (const int standard : {0, 1, 2})
    if (const int nothing = ::open("/dev/null", O_RDWR); nothing >= 0) ::dup2(nothing, standard);
  Told told;
  try {
    told = run_here(run);
  } catch (const std::exception& error) {
    told.problem = error.what();
  }
  const std::string text = json(told).dump(-1, ' ', true, json::error_handler_t::replace);
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t count = ::write(to, text.data() + sent, text.size() - sent);
    if (count <= 0) break;
    sent += static_cast<std::size_t>(count);
  }
  ::_exit(0);
}

Told Processes::run_here(const Run& run) {
  Console console;
  Simulator simulator(run.config, config::build_nodes(run.config, files_), start_.plant_file, console, false);
  explore::Judge judge({simulator.session().control(), settings_, run.counted, run.values_may_differ,
                        run.must_survive, run.undisturbed, [&](Time duration) { simulator.pass(duration); }});
  simulator.session().watch([&judge] { return judge.look(); });
  const int code = simulator.run(start_.command);
  simulator.session().watch({});
  Told told{judge.end(code), {}, {}};
  told.record = judge.record();
  return told;
}

void Processes::wait(const std::function<void(std::size_t, const Told&)>& ended) {
  std::vector<pollfd> ends;
  for (const Process& process : processes_)
    ends.push_back({process.end.get(), POLLIN, 0});
  ::poll(ends.data(), ends.size(), 1000);
  for (std::size_t i = ends.size(); i-- != 0;) {
    Process& process = processes_[i];
    const bool is_slow = io::Reactor::now() - process.begun > kWallLimit;
    if (is_slow) ::kill(process.id, SIGKILL);
    if (!is_slow && (ends[i].revents == 0 || read_some(process.end.get(), process.text))) continue;
    ::waitpid(process.id, nullptr, 0);
    const Process over = std::move(process);
    processes_.erase(processes_.begin() + static_cast<std::ptrdiff_t>(i));
    ended(over.number, told_in(over.text));
  }
}

}  // namespace cbcan::app
