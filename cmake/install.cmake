# SPDX-License-Identifier: MIT
# What `cmake --install` puts where, in two components: `programs` for those who run cbcan, `dev` for those who build with it.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/cbcan)

# cbcan_install_libraries(FILE NAME...): the libraries cbcan::NAME with FILE.cmake, which makes those targets elsewhere.
function(cbcan_install_libraries file)
  set(targets "")
  foreach(name IN LISTS ARGN)
    get_target_property(target cbcan::${name} ALIASED_TARGET)
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
    list(APPEND targets ${target})
  endforeach()
  install(TARGETS ${targets} EXPORT ${file} COMPONENT dev ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT ${file} NAMESPACE cbcan:: DESTINATION ${package_folder} COMPONENT dev)
endfunction()

function(cbcan_install_headers)
  install(DIRECTORY ${ARGN} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
endfunction()

# ---- Libraries

cbcan_install_libraries(cbcan-firmware canopen core rtu slcan regmap)
cbcan_install_headers(firmware/cbcan regmap/include/cbcan)

if(TARGET cbcan::cia405)
  cbcan_install_libraries(cbcan-cia405 cia405 client)
  cbcan_install_headers(tools/cia405/include/cbcan)
  configure_file(cmake/cbcan-cia405.pc.in cbcan-cia405.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/cbcan-cia405.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endif()

write_basic_package_version_file(cbcan-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/cbcan-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/cbcan-config-version.cmake
  DESTINATION ${package_folder} COMPONENT dev)

# ---- Programs, and what they come with

if(TARGET cbcan-sim)
  set(data ${CMAKE_INSTALL_DATADIR}/cbcan)
  install(TARGETS cbcan-sim cbcanctl COMPONENT programs)
  install(DIRECTORY plants DESTINATION ${data} COMPONENT programs)
  install(DIRECTORY tools/st DESTINATION ${data} COMPONENT programs FILES_MATCHING PATTERN "*.st" PATTERN "*.xml")
endif()
