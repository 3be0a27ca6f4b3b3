# SPDX-License-Identifier: MIT
# cbcan_object_dictionary(TARGET FILE): TARGET may include "NAME.hpp", which cbcan-eds makes of FILE, an EDS or DCF file called NAME.
# CBCAN_EDS is the program; a build for a microcontroller needs one that runs on the host.
if(NOT TARGET cbcan-eds)
  find_program(CBCAN_EDS cbcan-eds HINTS ${CMAKE_BINARY_DIR}/../bin)
endif()

function(cbcan_object_dictionary target file)
  set(program cbcan-eds)
  if(NOT TARGET cbcan-eds)
    set(program ${CBCAN_EDS})
    if(NOT program)
      message(FATAL_ERROR "cbcan_object_dictionary: build cbcan-eds on the host, and set CBCAN_EDS to it")
    endif()
  endif()
  get_filename_component(path ${file} ABSOLUTE)
  get_filename_component(name ${file} NAME_WE)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${target}_dictionary)
  file(MAKE_DIRECTORY ${folder})
  add_custom_command(OUTPUT ${folder}/${name}.hpp
    COMMAND ${program} ${path} >${folder}/${name}.hpp
    DEPENDS ${program} ${path})
  target_sources(${target} PRIVATE ${folder}/${name}.hpp)
  target_include_directories(${target} PRIVATE ${folder})
endfunction()
