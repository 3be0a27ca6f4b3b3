// SPDX-License-Identifier: MIT
#pragma once

/// A substitute for FreeRTOS's headers, not part of it: what examples/rtos uses of them, with the types of
/// FreeRTOS 11 on a Cortex-M. A test defines the functions.

#include <stdint.h>

#define configTICK_RATE_HZ 1000
#define pdTRUE 1
#define pdFALSE 0
#define portMAX_DELAY 0xFFFFFFFFu
#define portYIELD_FROM_ISR(switch_task) static_cast<void>(switch_task)

typedef long BaseType_t;
typedef unsigned long UBaseType_t;
typedef uint32_t TickType_t;
typedef void (*TaskFunction_t)(void*);
typedef struct tskTaskControlBlock* TaskHandle_t;
typedef struct QueueDefinition* QueueHandle_t;

extern "C" {
BaseType_t xTaskCreate(TaskFunction_t task, const char* name, uint32_t stack_words, void* argument,
                       UBaseType_t priority, TaskHandle_t* handle);
void vTaskStartScheduler();
uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks);
BaseType_t xTaskNotifyGive(TaskHandle_t task);
void vTaskNotifyGiveFromISR(TaskHandle_t task, BaseType_t* switch_task);
QueueHandle_t xQueueCreate(UBaseType_t items, UBaseType_t bytes);
BaseType_t xQueueSend(QueueHandle_t queue, const void* item, TickType_t ticks);
BaseType_t xQueueReceive(QueueHandle_t queue, void* item, TickType_t ticks);
}
