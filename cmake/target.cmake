# SPDX-License-Identifier: MIT
# cbcan_target(NAME): common settings of our targets; they do not apply to third-party code.
option(CBCAN_SANITIZE "AddressSanitizer, UndefinedBehaviorSanitizer and libFuzzer's counters (clang); build the fuzz targets" OFF)
option(CBCAN_COVERAGE "Count which lines and branches run (gcc)" OFF)

function(cbcan_target name)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_compile_options(${name} PRIVATE
    -Wall -Wextra -Wpedantic $<$<BOOL:${PROJECT_IS_TOP_LEVEL}>:-Werror> -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast -Wnon-virtual-dtor
    -Woverloaded-virtual -Wcast-align -Wdouble-promotion -Wformat=2 -Wimplicit-fallthrough)
  if(NOT CMAKE_CROSSCOMPILING)
    target_compile_definitions(${name} PRIVATE $<$<NOT:$<CONFIG:Release>>:_GLIBCXX_ASSERTIONS>)
  endif()
  if(CBCAN_SANITIZE)
    target_compile_options(${name} PUBLIC -fsanitize=fuzzer-no-link,address,undefined,float-cast-overflow -fno-sanitize-recover=all -fno-omit-frame-pointer
      -fno-sanitize-coverage=trace-cmp)  # costs half of the fuzzer's time; corpora and dictionaries contain the numbers
    target_link_options(${name} PUBLIC -fsanitize=fuzzer-no-link,address,undefined,float-cast-overflow)
  endif()
  if(CBCAN_COVERAGE)
    target_compile_options(${name} PUBLIC --coverage)
    target_link_options(${name} PUBLIC --coverage)
  endif()
endfunction()
