# SPDX-License-Identifier: MIT
# Headers for firmware that programs on the host make of description files. A build for a microcontroller needs CBCAN_EDS and
# CBCAN_NETWORK: the programs of a build on the host, whose folder is usually found.
foreach(room eds network)
  string(TOUPPER CBCAN_${room} variable)
  if(TARGET cbcan-${room})
    set(${variable} cbcan-${room})
  else()
    find_program(${variable} cbcan-${room} HINTS ${CMAKE_BINARY_DIR}/../bin)
  endif()
endforeach()

# cbcan_object_dictionary(TARGET FILE): TARGET may include "NAME.hpp", the dictionary of FILE, an EDS or DCF file called NAME.
function(cbcan_object_dictionary target file)
  cbcan_made_header(${target} ${file} CBCAN_EDS)
endfunction()

# cbcan_network_header(TARGET FILE): the same for a network file, with the object kNetwork.
function(cbcan_network_header target file)
  cbcan_made_header(${target} ${file} CBCAN_NETWORK)
endfunction()

function(cbcan_made_header target file program)
  if(NOT ${program})
    message(FATAL_ERROR "${file}: set ${program} to the program of a build on the host")
  endif()
  get_filename_component(path ${file} ABSOLUTE)
  get_filename_component(name ${file} NAME_WE)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${target}_made)
  file(MAKE_DIRECTORY ${folder})
  add_custom_command(OUTPUT ${folder}/${name}.hpp
    COMMAND ${${program}} ${path} >${folder}/${name}.hpp
    DEPENDS ${${program}} ${path})
  target_sources(${target} PRIVATE ${folder}/${name}.hpp)
  target_include_directories(${target} PRIVATE ${folder})
endfunction()
