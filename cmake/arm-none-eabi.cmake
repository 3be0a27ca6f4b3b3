# SPDX-License-Identifier: MIT
# Cortex-M, freestanding: the core and the board images.
if(NOT DEFINED CBCAN_CPU)
  set(CBCAN_CPU cortex-m3)
endif()
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR ${CBCAN_CPU})
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_CXX_FLAGS_INIT
  "-mcpu=${CBCAN_CPU} -mthumb -ffreestanding -fno-exceptions -fno-rtti -fno-unwind-tables -fno-asynchronous-unwind-tables \
-fno-threadsafe-statics -ffunction-sections -fdata-sections -fstack-usage -Wstack-usage=512 -Werror=stack-usage=512")
set(CMAKE_CXX_FLAGS_MINSIZEREL_INIT "-Os -g -DNDEBUG")
# Images link with -nostdlib: only library functions that the compiler calls; nothing that allocates or prints.
set(CMAKE_CXX_STANDARD_LIBRARIES "-lc_nano -lgcc")
