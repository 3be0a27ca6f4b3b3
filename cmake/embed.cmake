# SPDX-License-Identifier: MIT
# cbcan_embed(OUT.cpp FOLDER DIR HEADER H FUNCTION F): all files of DIR, byte for byte, in a generated source. F(), which H declares,
# returns a std::span<const config::EmbeddedFile>, in the order of their names. OUT.cpp is generated at build time in the current binary
# directory, again whenever a file changes, is added or removed. In WebAssembly, which is downloaded, our files of the page are without
# comments and indentation.
#
# As a script (cmake -DFOLDER=... -P embed.cmake) this file writes that source.
if(NOT CMAKE_SCRIPT_MODE_FILE)
  function(cbcan_embed out)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "FOLDER;HEADER;FUNCTION" "")
    file(GLOB files CONFIGURE_DEPENDS ${arg_FOLDER}/*)
    add_custom_command(
      OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${out}
      COMMAND ${CMAKE_COMMAND} -DOUT=${CMAKE_CURRENT_BINARY_DIR}/${out} -DFOLDER=${arg_FOLDER} -DHEADER=${arg_HEADER}
        -DFUNCTION=${arg_FUNCTION} -DPROCESSOR=${CMAKE_SYSTEM_PROCESSOR} -P ${CMAKE_CURRENT_FUNCTION_LIST_FILE}
      DEPENDS ${files} ${CMAKE_CURRENT_FUNCTION_LIST_FILE}
      COMMENT "Embedding ${arg_FOLDER}"
      VERBATIM)
  endfunction()
  return()
endif()

file(GLOB files ${FOLDER}/*)
foreach(file IN LISTS files)
  get_filename_component(name ${file} NAME)
  file(READ ${file} text HEX)
  if(PROCESSOR STREQUAL "wasm32" AND name MATCHES "^[a-z]+\\.(js|css|html)$")
    file(READ ${file} text)
    string(REGEX REPLACE "\n[ \n]*((//[^\n]*|/\\*[^\n]*\\*/)\n[ \n]*)*" "\n" text "\n${text}")
    string(SUBSTRING "${text}" 1 -1 text)
    string(HEX "${text}" text)
  endif()
  string(REGEX REPLACE "(................................)" "\\1\"\n     \"" text "${text}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "\\\\x\\1" text "${text}")
  string(APPEND rows "    {\"${name}\",\n     \"${text}\"sv},\n")
endforeach()
file(WRITE ${OUT} "// Made by cmake/embed.cmake from ${FOLDER}; do not edit.
#include \"${HEADER}\"

using namespace std::string_view_literals;

std::span<const cbcan::config::EmbeddedFile> ${FUNCTION}() {
  static constexpr cbcan::config::EmbeddedFile kFiles[] = {
${rows}};
  return kFiles;
}
")
