# SPDX-License-Identifier: MIT
# cbcan_target(NAME): what every target of ours has in common. Nobody else's code is held to it.
option(CBCAN_SANITIZE "AddressSanitizer and UndefinedBehaviorSanitizer" OFF)
option(CBCAN_FUZZ "Build the fuzz targets with libFuzzer and both sanitizers (clang), and no other test" OFF)
option(CBCAN_COVERAGE "Count which lines and branches run (gcc)" OFF)

function(cbcan_target name)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_compile_options(${name} PRIVATE
    -Wall -Wextra -Wpedantic -Werror -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast -Wnon-virtual-dtor
    -Woverloaded-virtual -Wcast-align -Wdouble-promotion -Wformat=2 -Wimplicit-fallthrough)
  if(CBCAN_SANITIZE)
    target_compile_options(${name} PUBLIC -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${name} PUBLIC -fsanitize=address,undefined)
    target_compile_options(${name} PRIVATE -Wno-maybe-uninitialized)  # gcc sees it in its own instrumentation
  endif()
  if(CBCAN_COVERAGE)
    target_compile_options(${name} PUBLIC --coverage)
    target_link_options(${name} PUBLIC --coverage)
  endif()
  if(CBCAN_FUZZ)
    target_compile_options(${name} PUBLIC -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all
      -fno-sanitize-coverage=trace-cmp)  # half of the time; the corpora and dictionaries know the numbers
    target_link_options(${name} PUBLIC -fsanitize=fuzzer-no-link,address,undefined)
  endif()
endfunction()
