/* SPDX-License-Identifier: MIT */
extern WORD *__MW3700, *__MW3701, *__MW3702, *__MW3703, *__MW3704, *__MW3705, *__MW3706;

static void FILL_init__(FILL* data) {
  WORD* words[] = {__MW3700, __MW3701, __MW3702, __MW3703, __MW3704, __MW3705, __MW3706};
  for (int i = 0; i < 7; ++i)
    (&data->FLAG)[i].value = words[i];
  data->SINCE.tv_sec = -1;
}

/* TON: milliseconds since IN has been TRUE */
static long pause(FILL* data) {
  if (data->ASKED.value)
    data->SINCE.tv_sec = -1;
  else if (data->SINCE.tv_sec < 0)
    data->SINCE = __CURRENT_TIME;
  return data->ASKED.value ? 0
                           : (__CURRENT_TIME.tv_sec - data->SINCE.tv_sec) * 1000 +
                                 (__CURRENT_TIME.tv_nsec - data->SINCE.tv_nsec) / 1000000;
}

static void FILL_body__(FILL* data) {
  const long waited = pause(data);
  if (data->ASKED.value && *data->FLAG.value != 0xCA0E) {
    const BOOL ok = *data->FLAG.value == 0 && *data->COMMAND.value != 0;
    data->ASKED.value = 0;
    if (ok) {
      data->DONE.value = data->WRITES.value && data->CLOSING.value;
      data->CLOSING.value = (!data->WRITES.value && *data->DATA.value >= 8000) || data->CLOSING.value;
      data->WRITES.value = !data->WRITES.value;
    }
  } else if (waited >= 300) {
    const BOOL writes = data->WRITES.value;
    data->ASKED.value = 1;
    *data->COMMAND.value = writes ? 0x13CA : 0x13BF;
    *data->NODE.value = 0x42;
    *data->INDEX.value = writes ? 0x6200 : 0x6401;
    *data->PART.value = 1;
    *data->SIZE.value = writes ? 1 : 2;
    if (writes) *data->DATA.value = !data->CLOSING.value;
    *data->FLAG.value = 0xCA0E;
  }
}
