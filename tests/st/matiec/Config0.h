/* SPDX-License-Identifier: MIT */
extern UINT* __GET_GLOBAL_UNUSED(void);
