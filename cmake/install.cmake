# SPDX-License-Identifier: MIT
# `cmake --install`, in two components: `programs` to run cbcan, `dev` to build with it.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/cbcan)

# cbcan_install_libraries(FILE NAME...): installs the libraries cbcan::NAME and FILE.cmake, which defines these targets in other projects.
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
  install(DIRECTORY ${ARGN} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp"
    PATTERN configuration.hpp EXCLUDE)
endfunction()

# ---- Libraries

cbcan_install_libraries(cbcan-firmware canopen core rtu slcan station regmap)
cbcan_install_headers(firmware/cbcan regmap/include/cbcan)
set(boards ${CMAKE_INSTALL_INCLUDEDIR}/cbcan/station)  # of "boards/common/station.hpp"
install(DIRECTORY firmware/boards/common DESTINATION ${boards}/boards COMPONENT dev FILES_MATCHING PATTERN "*.hpp")
target_include_directories(cbcan_station INTERFACE $<INSTALL_INTERFACE:${boards}>)
set(configuration firmware)
if(CBCAN_CONFIGURATION)
  set(configuration ${CBCAN_CONFIGURATION})
endif()
install(FILES ${configuration}/cbcan/configuration.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/cbcan COMPONENT dev)

if(TARGET cbcan::cia405)
  cbcan_install_libraries(cbcan-window window cia405)
  cbcan_install_headers(hostsim/window/include/cbcan tools/cia405/include/cbcan)
  configure_file(cmake/cbcan-cia405.pc.in cbcan-cia405.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/cbcan-cia405.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endif()

install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libcbcan-dev COMPONENT dev
  FILES_MATCHING PATTERN "*.cpp" PATTERN "*.hpp" PATTERN "*.py" PATTERN "*.ini" PATTERN "*.eds" PATTERN CMakeLists.txt)
if(TARGET cbcan::sim)
  cbcan_install_libraries(cbcan-sim sim)
  cbcan_install_headers(hostsim/plant/include/cbcan)
endif()

write_basic_package_version_file(cbcan-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/cbcan-config.cmake cmake/object_dictionary.cmake ${CMAKE_CURRENT_BINARY_DIR}/cbcan-config-version.cmake
  DESTINATION ${package_folder} COMPONENT dev)

# ---- Programs and their files

if(NOT TARGET cbcan-sim)
  return()
endif()
# Generated from the programs and the register table: manual pages, completion, lists of registers.
find_package(Python3 3.9 REQUIRED COMPONENTS Interpreter)
set(share ${CMAKE_BINARY_DIR}/share)
set(manuals man/man5/cbcan-plant.5 doc/cbcan/README.md)
foreach(name cbcan-eds cbcan-network cbcan-sim cbcan-st cbcanctl)
  list(APPEND manuals man/man1/${name}.1 bash-completion/completions/${name})
endforeach()
list(TRANSFORM manuals PREPEND ${share}/)
file(GLOB_RECURSE pages CONFIGURE_DEPENDS docs/*.md)
file(GLOB_RECURSE python CONFIGURE_DEPENDS tools/python/*)
add_custom_command(OUTPUT ${manuals}
  COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/packaging/manuals $<TARGET_FILE_DIR:cbcan-sim> ${share}
  DEPENDS cbcan-eds cbcan-network cbcan-sim cbcanctl packaging/manuals packaging/owner README.md SECURITY.md CHANGELOG.md ${pages} ${python})
set(registers ${share}/doc/cbcan/registers)
add_custom_command(OUTPUT ${registers}.csv ${registers}.json
  COMMAND ${CMAKE_COMMAND} -E make_directory ${share}/doc/cbcan
  COMMAND cbcan-regmap csv >${registers}.csv
  COMMAND cbcan-regmap json >${registers}.json)
add_custom_target(documents ALL DEPENDS ${manuals} ${registers}.csv ${registers}.json)

set(data ${CMAKE_INSTALL_DATADIR}/cbcan)
install(TARGETS cbcan-sim cbcanctl cbcan-eds cbcan-network COMPONENT programs)
install(DIRECTORY plants scenarios DESTINATION ${data} COMPONENT programs)
install(DIRECTORY tools/st DESTINATION ${data} COMPONENT programs FILES_MATCHING PATTERN "*.st" PATTERN "*.xml" PATTERN "*.py"
  PATTERN __pycache__ EXCLUDE)
install(DIRECTORY ${share}/ DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT programs)
install(FILES packaging/cbcan-sim@.service DESTINATION lib/systemd/system COMPONENT programs)
install(DIRECTORY tools/python DESTINATION ${data} COMPONENT programs USE_SOURCE_PERMISSIONS PATTERN __pycache__ EXCLUDE)
foreach(name cbcan_plant.py cbcan_st)
  file(CREATE_LINK ../../../${data}/python/${name} ${CMAKE_CURRENT_BINARY_DIR}/${name} SYMBOLIC)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name} DESTINATION lib/python3/dist-packages COMPONENT programs)  # where Debian's Python looks
endforeach()
file(CREATE_LINK ../${data}/python/cbcan-st ${CMAKE_CURRENT_BINARY_DIR}/cbcan-st SYMBOLIC)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/cbcan-st DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
# What the pages link to: packaging/manuals.
install(DIRECTORY docs/pictures DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs COMPONENT programs)
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)
install(DIRECTORY packaging/cluster DESTINATION ${CMAKE_INSTALL_DOCDIR}/packaging COMPONENT programs)
install(FILES packaging/github.yml packaging/gitlab.yml DESTINATION ${CMAKE_INSTALL_DOCDIR}/packaging COMPONENT programs)
file(CREATE_LINK ../../cbcan/plants ${CMAKE_CURRENT_BINARY_DIR}/plants SYMBOLIC)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/plants DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)

# ---- Packages: cpack

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL programs dev)
set(CPACK_PACKAGE_CONTACT "the cbcan authors <cbcan@cbcan.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/packaging/debian.cmake)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
cmake_host_system_information(RESULT system QUERY DISTRIB_ID DISTRIB_VERSION_ID)
list(JOIN system "" CPACK_DEBIAN_PACKAGE_RELEASE)  # "debian12": a package belongs to the release that it was built on
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME cbcan)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION net)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS python3)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SUGGESTS "python3-pytest, can-utils")
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/prerm)
set(CPACK_COMPONENT_PROGRAMS_DESCRIPTION "cbcan-sim serves the registers by which a PLC does SDO and NMT services,
over Modbus, in front of simulated CANopen devices or a CAN interface.
cbcanctl is the PLC's side, from the command line.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libcbcan-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_RECOMMENDS "cbcan, pkg-config, libmodbus-dev, libfmt-dev, libtomlplusplus-dev, liblua5.4-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION "C++20 libraries, freestanding: CANopen (SDO, PDO, NMT, LSS and more), the
coprocessor behind registers, a Modbus RTU server, SLCAN, the common parts of
boards. cbcan-eds of the package cbcan makes a slave of an EDS file. For
programs: the PLC's side of the registers over Modbus, and the function blocks
of CiA 405 on it; they need libmodbus. For tests: a simulated plant, which
needs libfmt, libtomlplusplus and liblua5.4.")
include(CPack)
