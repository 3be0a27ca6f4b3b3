# SPDX-License-Identifier: MIT
# What the host's libraries and programs have besides. Release: what overruns a buffer ends the program, and the tables of the linker are
# read-only.
add_compile_options("$<$<CONFIG:Release>:-fstack-protector-strong;-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>")
add_link_options("$<$<CONFIG:Release>:LINKER:-z,relro,-z,now>")
# Eight files are compiled as one, in less than half the time. The builds to work with, and to count lines, notice a missing #include.
if(NOT CMAKE_BUILD_TYPE STREQUAL "Debug")
  set(CMAKE_UNITY_BUILD ON)
endif()
