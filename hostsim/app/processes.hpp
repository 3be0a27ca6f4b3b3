// SPDX-License-Identifier: MIT
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "config/build_node.hpp"
#include "config/command_line.hpp"
#include "io/loop/system.hpp"
#include "scenario/search/exploration.hpp"

namespace cbcan::app {

/// Runs the command, each time with its plant in a process of its own. A trial that takes too long on this
/// machine's clock is made again alone; if it does once more, it hangs, which is a failure. Throws
/// io::EnvironmentError.
class Processes final : public search::Runner {
 public:
  Processes(const config::Start& start, config::EdsFiles& files, const search::Settings& settings)
      : start_(start), files_(files), settings_(settings) {}

  void run_all(std::size_t count, const Make& make, const Wanted& wanted, const Ended& ended) override;

 private:
  struct Process {
    pid_t id;
    io::Descriptor end;
    io::Descriptor error;  ///< standard error of the command
    std::size_t number;
    Time begun;
    std::string text{};  ///< from `end`
    std::string said{};  ///< the last of `error`
  };

  void begin(std::size_t number, const search::Trial& trial);
  [[noreturn]] void be(const search::Trial& trial, int to, int error);
  search::TrialReport run_here(const search::Trial& trial, int error);
  /// Waits for one that ends, or that takes too long.
  void wait(const Ended& ended, const Ended& slow);

  const config::Start& start_;
  config::EdsFiles& files_;
  const search::Settings& settings_;
  std::vector<Process> processes_;
};

}  // namespace cbcan::app
