// SPDX-License-Identifier: MIT
// Writes object 2004h of node 20h of `cbcan-sim --demo`, reads it, its name, and an object that does not exist:
// libmodbus. cc three_libmodbus.c $(pkg-config --cflags --libs libmodbus)
#include <errno.h>
#include <modbus.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static modbus_t *plc;
static uint16_t window[70];  // R3700..R3769

// One SDO transfer of `words` data words in window[6..]; returns R3700.
static int transact(int command, int node, int index, int sub, int size, int words) {
  const uint16_t head[6] = {0xCA0E, command, node, index, sub, size};
  for (int i = 0; i < 6; ++i) window[i] = head[i];
  int done = modbus_write_registers(plc, 3700, 6 + words, window);
  while (done != -1 && window[0] == 0xCA0E) done = modbus_read_registers(plc, 3700, 70, window);
  if (done == -1) {
    fprintf(stderr, "%s\n", modbus_strerror(errno));
    exit(1);
  }
  return window[0];
}

int main(void) {
  plc = modbus_new_tcp("127.0.0.1", 1502);
  modbus_set_slave(plc, 1);
  if (modbus_connect(plc) == -1) {
    fprintf(stderr, "%s\n", modbus_strerror(errno));
    return 1;
  }
  const uint32_t value = 123456789;
  window[6] = value & 0xFFFF;  // low word first
  window[7] = value >> 16;
  if (transact(5066, 0x20, 0x2004, 0, 4, 2) == 0 && transact(5055, 0x20, 0x2004, 0, 4, 0) == 0)
    printf("2004h = %u\n", window[6] | (unsigned)window[7] << 16);
  if (transact(5055, 0x20, 0x1008, 0, 128, 0) == 0) {
    printf("1008h = ");
    for (int i = 0; i < window[5]; ++i) putchar(window[6 + i / 2] >> 8 * (i % 2) & 0xFF);
    putchar('\n');
  }
  if (transact(5055, 0x20, 0x3333, 0, 4, 0) == 4)
    printf("3333h: abort %04X %04Xh\n", window[7], window[6]);
  modbus_close(plc);
  modbus_free(plc);
}
