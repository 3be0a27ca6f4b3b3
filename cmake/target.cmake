# SPDX-License-Identifier: MIT
# cbcan_target(NAME): the settings of every target of this project; vendored code has none of them.
option(CBCAN_SANITIZE "AddressSanitizer and UndefinedBehaviorSanitizer (clang)" OFF)
option(CBCAN_FUZZ "With CBCAN_SANITIZE: libFuzzer's counters, and the fuzz targets" OFF)
option(CBCAN_COVERAGE "Count which lines and branches run (gcc)" OFF)

function(cbcan_target name)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_compile_options(${name} PRIVATE
    -Wall -Wextra -Wpedantic $<$<BOOL:${PROJECT_IS_TOP_LEVEL}>:-Werror> -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast -Wnon-virtual-dtor
    -Woverloaded-virtual -Wcast-align -Wdouble-promotion -Wformat=2 -Wimplicit-fallthrough)
  if(CMAKE_CROSSCOMPILING)
    target_compile_options(${name} PRIVATE -Wno-psabi)  # a note about GCC 7, not about us
  else()
    target_compile_definitions(${name} PRIVATE $<$<NOT:$<CONFIG:Release>>:_GLIBCXX_ASSERTIONS>)
  endif()
  if(CBCAN_SANITIZE)
    # Leaves out vptr: its check opens a pipe, and reports falsely when no descriptor is left.
    set(sanitizers -fsanitize=address,undefined,float-cast-overflow -fno-sanitize=vptr)
    target_compile_options(${name} PUBLIC ${sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${name} PUBLIC ${sanitizers})
  endif()
  if(CBCAN_FUZZ)
    # Leaves out comparisons, which take half of the fuzzer's time; the corpora and dictionaries have the numbers.
    target_compile_options(${name} PUBLIC -fsanitize=fuzzer-no-link -fno-sanitize-coverage=trace-cmp)
    target_link_options(${name} PUBLIC -fsanitize=fuzzer-no-link)
  endif()
  if(CBCAN_COVERAGE)
    target_compile_options(${name} PUBLIC --coverage -fprofile-update=atomic)  # threads count too
    target_link_options(${name} PUBLIC --coverage)
  endif()
endfunction()

# cbcan_library(NAME ALIAS SOURCE... [EXCEPT SOURCE] [LIBS TARGET...]): the library cbcan::ALIAS; * in SOURCE stands for
# files and folders. LIBS are public, those after PRIVATE are not.
function(cbcan_library name alias)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "EXCEPT" "LIBS")
  file(GLOB sources CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} ${arg_UNPARSED_ARGUMENTS})
  list(REMOVE_ITEM sources "${arg_EXCEPT}")
  add_library(${name} STATIC ${sources})
  add_library(cbcan::${alias} ALIAS ${name})
  cbcan_target(${name})
  target_link_libraries(${name} PUBLIC ${arg_LIBS})
endfunction()
