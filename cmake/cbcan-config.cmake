# SPDX-License-Identifier: MIT
# find_package(cbcan [COMPONENTS canopen core rtu slcan cia405]): a target cbcan::NAME for each. Only cia405 needs a library, libmodbus; without
# COMPONENTS it is left out where that is missing.
include(${CMAKE_CURRENT_LIST_DIR}/cbcan-firmware.cmake)

if("cia405" IN_LIST cbcan_FIND_COMPONENTS OR NOT cbcan_FIND_COMPONENTS)
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(libmodbus QUIET IMPORTED_TARGET GLOBAL libmodbus)
  endif()
  if(TARGET PkgConfig::libmodbus)
    include(${CMAKE_CURRENT_LIST_DIR}/cbcan-cia405.cmake OPTIONAL)
  endif()
endif()

foreach(component IN LISTS cbcan_FIND_COMPONENTS)
  if(TARGET cbcan::${component})
    set(cbcan_${component}_FOUND TRUE)
  elseif(cbcan_FIND_REQUIRED_${component})
    set(cbcan_FOUND FALSE)
    string(APPEND cbcan_NOT_FOUND_MESSAGE "cbcan::${component} is not there; ")
    if(component STREQUAL "cia405")
      string(APPEND cbcan_NOT_FOUND_MESSAGE "it needs pkg-config and libmodbus, when it is built and here")
    else()
      string(APPEND cbcan_NOT_FOUND_MESSAGE "the components are canopen, core, rtu, slcan and cia405")
    endif()
  endif()
endforeach()
