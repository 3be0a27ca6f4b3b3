// SPDX-License-Identifier: MIT
// examples/rtos on a kernel, a board and other tasks that the test plays, in virtual time: it runs the task
// until that waits, then what comes next. A wait ends with a tick, or when the task has been notified.
#include "../../examples/rtos/slave_task.hpp"

#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace cbcan::test {

namespace {

struct End {};

struct World final : CanPort {
  bool try_send(const Frame& frame) override {
    turn += text_of(frame) + " ";
    if (preempt) std::exchange(preempt, nullptr)();
    return true;
  }

  // The board.
  CanPort& can() { return *this; }
  void start() {}
  Time now() { return time; }
  BusState bus_state(int) { return BusState::kActive; }
  bool receive(int, Frame& frame) { return take(received, frame); }

  static bool take(auto& queue, auto& item) {
    if (queue.empty()) return false;
    item = queue.front();
    queue.pop_front();
    return true;
  }

  std::uint32_t wait(TickType_t ticks) {
    const bool forever = ticks == 1'800'000;  // half an hour, in which boards::Clock has to be read
    log.push_back(std::to_string(time) + " " + turn + "wait " + std::to_string(ticks));
    turn.clear();
    const Time end = forever ? kNever : (time / kMillisecond + ticks) * kMillisecond;
    for (; notifications == 0 && !steps.empty() && steps.front().first < end; steps.pop_front()) {
      time = steps.front().first;
      steps.front().second();
    }
    if (log.size() > 100 || (notifications == 0 && forever)) throw End();
    if (notifications == 0) time = end;
    return std::exchange(notifications, 0);
  }

  std::deque<std::pair<Time, std::function<void()>>> steps;
  std::function<void()> preempt;  ///< while the next frame is sent
  std::vector<std::string> log;
  std::string turn;  ///< what the task has sent since it waited
  Time time = 0;
  TaskFunction_t run = nullptr;
  std::uint32_t notifications = 0;
  std::deque<Frame> received;
  std::deque<std::uint8_t> queue;
} world;

SlaveTask task(world);

void hear(const char* frame) {
  world.received.push_back(frame_from(frame));
  task.notify();
}

}  // namespace

TEST_CASE("The slave as a task sends values in order, and sleeps until it has something to do") {
  const auto fill_queue = [] {
    for (std::uint8_t levels = 0x10; levels < 0x18; ++levels)
      CHECK(task.send_inputs(levels));
    CHECK_FALSE(task.send_inputs(0x18));
  };
  world.steps = {
      {300, [] { hear("642#2B1710000A000000"); }},  // heartbeat: 10 ms
      {12'100, [] { hear("000#0142"); }},
      {15'000, [] { world.preempt = [] { CHECK(task.send_inputs(9)); }; }},
      {22'000, [] { CHECK(task.send_inputs(1)); }},
      {22'500, [] { CHECK((task.send_inputs(2) && task.send_inputs(3))); }},
      {24'000, [] { hear("242#A5"); }},
      {25'000, [] { hear("642#2B17100000000000"); }},
      {26'000, fill_queue},
  };
  task.create();
  CHECK_THROWS_AS(world.run(&task), End);
  CHECK(task.outputs() == 0xA5);
  const std::vector<std::string> expected = {
      "0 742#00 wait 1800000",
      "300 5C2#6017100000000000 wait 10",
      "10000 wait 1",  // the wait began within a tick: it was shorter than 10 ms
      "11000 742#7F wait 10",
      "12100 1C2#00 2C2#D204FEFF wait 9",
      "21000 742#05 wait 10",  // not at all: it has been notified since it read the queue
      "21000 1C2#09 wait 10",
      "22000 1C2#01 wait 9",
      "22500 1C2#03 wait 8",
      "24000 wait 7",
      "25000 5C2#6017100000000000 wait 1800000",
      "26000 1C2#17 wait 1800000",
  };
  CHECK(world.log == expected);
}

}  // namespace cbcan::test

using cbcan::test::world;

BaseType_t xTaskCreate(TaskFunction_t run, const char*, std::uint32_t, void*, UBaseType_t, TaskHandle_t*) {
  world.run = run;
  return pdTRUE;
}
std::uint32_t ulTaskNotifyTake(BaseType_t, TickType_t ticks) {
  return world.wait(ticks);
}
BaseType_t xTaskNotifyGive(TaskHandle_t) {
  ++world.notifications;
  return pdTRUE;
}
void vTaskNotifyGiveFromISR(TaskHandle_t task, BaseType_t* switch_task) {
  *switch_task = xTaskNotifyGive(task);
}
QueueHandle_t xQueueCreate(UBaseType_t, UBaseType_t) {
  return nullptr;
}
BaseType_t xQueueSend(QueueHandle_t, const void* item, TickType_t) {
  if (world.queue.size() == 8) return pdFALSE;
  world.queue.push_back(*static_cast<const std::uint8_t*>(item));
  return pdTRUE;
}
BaseType_t xQueueReceive(QueueHandle_t, void* item, TickType_t) {
  return world.take(world.queue, *static_cast<std::uint8_t*>(item));
}
