# SPDX-License-Identifier: MIT
# Programs without shared libraries: they run on every Linux. Debian has fmt and toml++ as shared libraries only, so their headers are compiled.
set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
foreach(library fmt::fmt tomlplusplus::tomlplusplus)
  add_library(${library} INTERFACE IMPORTED GLOBAL)
endforeach()
target_compile_definitions(fmt::fmt INTERFACE FMT_HEADER_ONLY)
add_link_options(-static-pie -s)
cmake_language(DEFER CALL target_sources cbcan-sim PRIVATE ${PROJECT_SOURCE_DIR}/cmake/static_names.cpp)
cmake_language(DEFER CALL target_sources cbcanctl PRIVATE ${PROJECT_SOURCE_DIR}/cmake/static_names.cpp)

# The LGPL asks for its text, and for a way to link the programs with another version of its libraries.
set(again "linked statically: tools/dev/wheel of the source of cbcan, MIT licence, links the programs again with another version")
string(REGEX MATCH "^[0-9]+" gcc ${CMAKE_CXX_COMPILER_VERSION})
foreach(library libmicrohttpd libmodbus)
  file(STRINGS ${CMAKE_BINARY_DIR}/${library}/debian/changelog first LIMIT_COUNT 1)
  string(REGEX MATCH "[0-9][^)]*" ${library} "${first}")
endforeach()
include(cmake/licences.cmake)
cbcan_licences(${CMAKE_BINARY_DIR}/LICENSE
  "GNU C Library, ${again}" libc6-dev
  "GNU libmicrohttpd ${libmicrohttpd}, ${again}" ${CMAKE_BINARY_DIR}/libmicrohttpd/debian/copyright
  "libmodbus ${libmodbus}, ${again}" ${CMAKE_BINARY_DIR}/libmodbus/debian/copyright
  "GNU Lesser General Public License" /usr/share/common-licenses/LGPL-2.1
  "libstdc++, libgcc" libstdc++-${gcc}-dev
  "fmt" libfmt-dev "toml++" libtomlplusplus-dev "JSON for Modern C++" nlohmann-json3-dev "Lua" liblua5.4-dev
  "uPlot" ${PROJECT_SOURCE_DIR}/hostsim/web/page/uPlot.LICENSE)
