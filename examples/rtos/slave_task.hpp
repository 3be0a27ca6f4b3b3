// SPDX-License-Identifier: MIT
#pragma once

/// The slave of ../slave as a task of FreeRTOS, the only one that calls the stack.

#include <FreeRTOS.h>
#include <queue.h>
#include <task.h>

#include <atomic>

#include "../slave/module.hpp"

/// `Board`: as for the slave's run(); notify() instead of sleep_until().
template <class Board>
class SlaveTask {
 public:
  explicit SlaveTask(Board& board) : board_(board) {}

  /// Call it once, before vTaskStartScheduler().
  void create() {
    static_assert(configTICK_RATE_HZ == 1000, "a tick is a millisecond");
    constexpr unsigned kStackWords = 384, kPriority = 3, kQueued = 8;
    inputs_ = xQueueCreate(kQueued, sizeof terminals_.inputs);
    const auto run = [](void* task) { static_cast<SlaveTask*>(task)->run(); };
    xTaskCreate(run, "CANopen", kStackWords, this, kPriority, &task_);
  }

  /// Call it at the end of an interrupt.
  void notify() {
    BaseType_t switch_task = pdFALSE;
    vTaskNotifyGiveFromISR(task_, &switch_task);
    portYIELD_FROM_ISR(switch_task);
  }

  // In other tasks.

  /// False: the queue is full.
  bool send_inputs(std::uint8_t levels) {
    const bool sent = xQueueSend(inputs_, &levels, 0) == pdTRUE;
    xTaskNotifyGive(task_);
    return sent;
  }
  std::uint8_t outputs() const { return outputs_; }

 private:
  /// Milliseconds; boards::Clock has to be read before its counter wraps.
  static constexpr std::uint32_t kLongestWait = 1'800'000;

  void run() {
    board_.start();
    module_.start(0x42, board_.now());
    for (;;) {
      const cbcan::Time now = board_.now();
      for (cbcan::Frame frame; board_.receive(0, frame);)
        module_.on_frame(frame, now);
      module_.on_bus_state(board_.bus_state(0), now);
      while (xQueueReceive(inputs_, &terminals_.inputs, 0) == pdTRUE)
        module_.read_inputs();
      const cbcan::Time due = module_.poll(now);
      outputs_ = terminals_.outputs;
      ulTaskNotifyTake(pdTRUE, cbcan::milliseconds_until(due, board_.now(), kLongestWait));
    }
  }

  Board& board_;
  Terminals terminals_{0, {1234, -2}};  // until other tasks send values
  Module module_{board_.can(), terminals_};
  TaskHandle_t task_ = nullptr;
  QueueHandle_t inputs_ = nullptr;
  std::atomic<std::uint8_t> outputs_ = 0;
};
