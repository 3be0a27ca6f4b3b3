// SPDX-License-Identifier: MIT
// examples/rtos on the board, with a kernel of one task instead of FreeRTOS.
#include "../../../examples/rtos/slave_task.hpp"

#include "boards/mps2_an385/board.hpp"

namespace {

using namespace cbcan::boards;

mps2::Board board(115'200, 500);
SlaveTask task(board);
Ring<std::uint8_t, 8> queue;
TaskFunction_t entry;

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = [] {
  auto table = mps2::vectors_of<board>();
  table.interrupts[mps2::kAdapterReceive] = [] {
    board.on_adapter_received();
    task.notify();
  };
  return table;
}();

}  // namespace

BaseType_t xTaskCreate(TaskFunction_t created, const char*, uint32_t, void*, UBaseType_t, TaskHandle_t*) {
  entry = created;
  return pdTRUE;
}
/// FreeRTOS, too, reads the first stack pointer from the vectors, at VTOR.
void vTaskStartScheduler() {
  if (Mmio(Mmio(0xE000ED08).read(0)).read(0) == reinterpret_cast<std::uintptr_t>(stack_end)) entry(&task);
}
uint32_t ulTaskNotifyTake(BaseType_t, TickType_t ticks) {
  board.sleep_until(board.now() + cbcan::milliseconds(ticks));
  return 0;
}
BaseType_t xTaskNotifyGive(TaskHandle_t) {
  return pdTRUE;
}
void vTaskNotifyGiveFromISR(TaskHandle_t, BaseType_t*) {}
QueueHandle_t xQueueCreate(UBaseType_t, UBaseType_t) {
  return nullptr;
}
BaseType_t xQueueSend(QueueHandle_t, const void* item, TickType_t) {
  return queue.push(*static_cast<const std::uint8_t*>(item));
}
BaseType_t xQueueReceive(QueueHandle_t, void* item, TickType_t) {
  return queue.pop(*static_cast<std::uint8_t*>(item));
}

int main() {
  task.create();
  task.send_inputs(0x5A);
  allow_vector_reads();
  vTaskStartScheduler();
  return 0;
}
