// SPDX-License-Identifier: MIT
#include "app/processes.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "app/run_many.hpp"
#include "app/simulator.hpp"
#include "io/loop/reactor.hpp"
#include "scenario/search/campaign.hpp"
#include "scenario/search/judge.hpp"
#include "scenario/search/state.hpp"

namespace cbcan::app {

namespace {

using search::Trial;
using search::TrialReport;

constexpr Time kWallLimit = 60 * kSecond;  ///< of a run on this machine's clock

/// False: there is no more.
bool read_some(int from, std::string& text) {
  char part[65536];
  const ssize_t count = ::read(from, part, sizeof part);
  if (count > 0) text.append(part, static_cast<std::size_t>(count));
  return count > 0;
}

/// What there is, of which the end is kept.
void read_said(int from, std::string& said) {
  constexpr std::size_t kMostSaid = 2000;
  pollfd ready{from, POLLIN, 0};
  while (::poll(&ready, 1, 0) > 0 && read_some(from, said))
    if (said.size() > 2 * kMostSaid) said.erase(0, said.size() - kMostSaid);
  if (said.size() > kMostSaid) said.erase(0, said.size() - kMostSaid);
}

std::pair<io::Descriptor, io::Descriptor> make_pipe() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw io::EnvironmentError("pipe: " + io::reason(errno));
  return {io::Descriptor(ends[0]), io::Descriptor(ends[1])};
}

/// `text`: what the process has sent that has ended with `status`.
TrialReport report_of(std::string_view text, int status) {
  TrialReport report;
  if (auto found = search::report_in(text))
    report = std::move(*found);
  else
    report.problem =
        WIFSIGNALED(status)
            ? fmt::format("the process with the plant was ended by signal {}; try again", WTERMSIG(status))
            : "the process with the plant has ended without a result; try again";
  return report;
}

}  // namespace

void Processes::run_all(std::size_t count, const Make& make, const Wanted& wanted, const Ended& ended) {
  std::vector<std::size_t> again;
  for (std::size_t next = 0; next < count || !processes_.empty();) {
    if (!wanted()) next = count;
    for (; next < count && processes_.size() < at_a_time(start_.search); ++next)
      begin(next, make(next));
    wait(ended, [&again](std::size_t slow, const TrialReport&) { again.push_back(slow); });
  }
  for (const std::size_t number : again) {
    if (!wanted()) return;
    begin(number, make(number));
    while (!processes_.empty())
      wait(ended, ended);
  }
}

void Processes::begin(std::size_t number, const Trial& trial) {
  auto [read_end, write_end] = make_pipe();
  auto [read_error, write_error] = make_pipe();
  const pid_t id = ::fork();
  if (id < 0) throw io::EnvironmentError("fork: " + io::reason(errno));
  if (id == 0) be(trial, write_end.get(), write_error.get());
  processes_.push_back({id, std::move(read_end), std::move(read_error), number, io::Reactor::now()});
}

/// Runs in the new process.
void Processes::be(const Trial& trial, int to, int error) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // the guard of the command then ends it
  for (const int standard : {0, 1, 2})
    if (const int nothing = ::open("/dev/null", O_RDWR); nothing >= 0) ::dup2(nothing, standard);
  TrialReport report;
  try {
    report = run_here(trial, error);
  } catch (const base::UsageError& mistake) {
    report.problem = mistake.what();
    report.is_usage = true;
  } catch (const std::exception& prevented) {
    report.problem = prevented.what();
  }
  const std::string text = search::line_of(report);
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t count = ::write(to, text.data() + sent, text.size() - sent);
    if (count <= 0) break;
    sent += static_cast<std::size_t>(count);
  }
  ::_exit(0);
}

/// Nothing outside the process changes: parameter files are copies, and logs are not written.
TrialReport Processes::run_here(const Trial& trial, int error) {
  config::Config config = trial.config;
  config.record.clear();
  config.pcap.clear();
  for (config::NetworkConfig& network : config.networks)
    network.log.clear();
  Console console;
  Simulator simulator(config, config::build_nodes(config, files_), start_.plant_file, console, false,
                      Simulator::Files::kCopied);
  search::Judge judge(simulator.session().control(), settings_, trial,
                      [&](Time duration) { simulator.let_pass(duration); });
  simulator.session().watch([&] {
    if (!judge.look()) simulator.stop();
  });
  const int code = simulator.run(start_.command, error);
  simulator.session().watch([&judge] { judge.keep_up(); });
  return judge.end(code);
}

void Processes::wait(const Ended& ended, const Ended& slow) {
  std::vector<pollfd> ends;
  for (const Process& process : processes_)
    ends.push_back({process.end.get(), POLLIN, 0});
  for (const Process& process : processes_)
    ends.push_back({process.error.get(), POLLIN, 0});
  const std::size_t count = processes_.size();
  ::poll(ends.data(), ends.size(), 1000);
  for (std::size_t i = count; i-- != 0;) {
    Process& process = processes_[i];
    const bool is_slow = io::Reactor::now() - process.begun > kWallLimit;
    if (is_slow) ::kill(process.id, SIGKILL);
    if (ends[count + i].revents != 0 || is_slow) read_said(process.error.get(), process.said);
    if (!is_slow && (ends[i].revents == 0 || read_some(process.end.get(), process.text))) continue;
    int status = 0;
    ::waitpid(process.id, &status, 0);
    read_said(process.error.get(), process.said);
    TrialReport report = is_slow ? search::hanging(kWallLimit) : report_of(process.text, status);
    report.result.said = search::indented(process.said);
    const std::size_t number = process.number;
    processes_.erase(processes_.begin() + static_cast<std::ptrdiff_t>(i));
    (is_slow ? slow : ended)(number, report);
  }
}

}  // namespace cbcan::app
