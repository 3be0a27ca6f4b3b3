# SPDX-License-Identifier: MIT
# Cortex-A53, bare metal, with Debian's Linux compiler: only its code generator and freestanding headers are used. No
# FPU (interrupts save no such registers), no unaligned access (the MMU is off), no helper functions for atomics.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-a53)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_CXX_FLAGS_INIT
  "-mcpu=cortex-a53 -mgeneral-regs-only -mstrict-align -mno-outline-atomics -ffreestanding -fno-exceptions -fno-rtti \
-fno-unwind-tables -fno-asynchronous-unwind-tables -fno-threadsafe-statics -fno-stack-protector -fno-pie \
-ffunction-sections -fdata-sections")
set(CMAKE_CXX_FLAGS_MINSIZEREL_INIT "-Os -g -DNDEBUG")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-nostdlib -static -no-pie -Wl,--gc-sections -Wl,--fatal-warnings -Wl,--build-id=none")
