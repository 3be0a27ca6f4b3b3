# SPDX-License-Identifier: MIT
# Release binaries for the host: what overruns a buffer ends the program, and the tables of the linker are read-only.
add_compile_options("$<$<CONFIG:Release>:-fstack-protector-strong;-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>")
add_link_options("$<$<CONFIG:Release>:LINKER:-z,relro,-z,now>")
