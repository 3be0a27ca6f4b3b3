# SPDX-License-Identifier: MIT
# Headers for firmware that programs on the host make of description files: those of this build, or CBCAN_EDS and CBCAN_NETWORK, which
# are found beside this file when it is installed, and for a microcontroller usually in the folder of the build on the host.
foreach(program eds network)
  string(TOUPPER CBCAN_${program} variable)
  find_program(${variable} cbcan-${program} HINTS ${CMAKE_BINARY_DIR}/../bin ${CMAKE_CURRENT_LIST_DIR}/../../../bin)
endforeach()

# cbcan_object_dictionary(TARGET FILE [NAME NAME]): TARGET may include "NAME.hpp", the dictionary of FILE, an EDS or DCF file. NAME is also the
# namespace; by default it is the file's name.
function(cbcan_object_dictionary target file)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "NAME" "")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "${file}: ${arg_UNPARSED_ARGUMENTS}: write NAME and the header's name")
  elseif(arg_NAME)
    cbcan_made_header(${target} ${file} eds ${arg_NAME} --name ${arg_NAME})
  else()
    get_filename_component(name ${file} NAME_WLE)
    cbcan_made_header(${target} ${file} eds ${name})
  endif()
endfunction()

# cbcan_network_header(TARGET FILE): the same for a network file, with the object kNetwork. It is made again when an EDS or DCF file that
# the network file names has changed.
function(cbcan_network_header target file)
  get_filename_component(name ${file} NAME_WLE)
  cbcan_made_header(${target} ${file} network ${name})
endfunction()

# Further arguments: options of the program.
function(cbcan_made_header target file program name)
  string(TOUPPER CBCAN_${program} variable)
  set(command ${${variable}})
  if(TARGET cbcan-${program})
    set(command $<TARGET_FILE:cbcan-${program}>)
  elseif(NOT command)
    message(FATAL_ERROR "${file}: set ${variable} to cbcan-${program}, of the package cbcan or of a build on the host")
  endif()
  get_filename_component(path ${file} ABSOLUTE)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${target}_made)
  file(MAKE_DIRECTORY ${folder})
  if(program STREQUAL "network")
    set(depfile ${folder}/${name}.hpp.d)  # the EDS and DCF files that it names
    list(APPEND ARGN --depfile ${depfile})
    set(depfile DEPFILE ${depfile})
  endif()
  add_custom_command(OUTPUT ${folder}/${name}.hpp
    COMMAND ${command} ${ARGN} --output ${folder}/${name}.hpp ${path}
    DEPENDS ${command} ${path}
    ${depfile}
    VERBATIM)
  target_sources(${target} PRIVATE ${folder}/${name}.hpp)
  target_include_directories(${target} PRIVATE ${folder})
endfunction()
