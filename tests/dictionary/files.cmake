# SPDX-License-Identifier: MIT
# cbcan_dictionaries(RESULT PROGRAM): makes dictionaries/dictionaries.hpp of all files by PROGRAM, cbcan-eds; RESULT is its path.
function(cbcan_dictionaries result program)
  file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/plants/demo/*.eds
    ${PROJECT_SOURCE_DIR}/tests/descriptions/corpus/*.eds ${PROJECT_SOURCE_DIR}/tests/descriptions/corpus/*.dcf ${PROJECT_SOURCE_DIR}/tests/st/plant/*.eds)
  set(make ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/make_dictionaries.py)
  if(TARGET ${program})
    set(command $<TARGET_FILE:${program}>)
  else()
    set(command ${program})
  endif()
  set(header ${CMAKE_CURRENT_BINARY_DIR}/dictionaries/dictionaries.hpp)
  add_custom_command(OUTPUT ${header} COMMAND ${make} ${command} ${CMAKE_CURRENT_BINARY_DIR}/dictionaries ${files}
    DEPENDS ${program} ${make} ${files})
  set(${result} ${header} PARENT_SCOPE)
endfunction()
