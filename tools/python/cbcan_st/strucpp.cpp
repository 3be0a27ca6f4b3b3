// SPDX-License-Identifier: MIT
// What compiled.py calls, for a program that STruC++ has translated. It writes generated.h.
#include <numeric>

#include "program.hpp"
using namespace strucpp;

#include "generated.h"

static const ResourceInstance& resource = configuration.get_resources()[0];
static long long interval;

extern "C" {
const char* names() {
  return NAMES;
}
void* value_of(int i) {
  return locatedVars[i].pointer;
}
void* register_of([[maybe_unused]] int i) {
  return REGISTERS;
}
int done() {
  return IS_DONE;
}
int gave_up() {
  return HAS_GIVEN_UP;
}

unsigned long long start() {
  for (size_t i = 0; i < resource.task_count; ++i)
    interval = std::gcd(interval, resource.tasks[i].interval_ns);
  return interval;
}

void scan(unsigned long tick, long long now) {
  __CURRENT_TIME_NS = now * 1000;
  for (size_t i = 0; i < resource.task_count; ++i) {
    const TaskInstance& task = resource.tasks[i];
    for (size_t j = 0; j < task.program_count && tick * interval % task.interval_ns == 0; ++j)
      task.programs[j]->run();
  }
}
}
