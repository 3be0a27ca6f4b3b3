# SPDX-License-Identifier: MIT
# What hostsim's pure directories need, for WebAssembly: the header-only libraries of this Debian by links, since /usr/include itself has glibc's
# headers, and Lua from its source package, compiled as C++: its errors are then exceptions, without setjmp.
set(CBCAN_LUA_SOURCE "" CACHE PATH "Lua's source, as tools/dev/module unpacks it")
set(links ${CMAKE_BINARY_DIR}/include)
file(MAKE_DIRECTORY ${links})
foreach(library fmt toml++ nlohmann fast_float)
  if(NOT EXISTS /usr/include/${library})
    message(FATAL_ERROR "/usr/include/${library} is missing; tools/dev/module installs what is needed")
  endif()
  file(CREATE_LINK /usr/include/${library} ${links}/${library} SYMBOLIC)
endforeach()
include_directories(SYSTEM ${CMAKE_CURRENT_LIST_DIR}/runtime/include ${links})

foreach(library fmt::fmt tomlplusplus::tomlplusplus nlohmann_json::nlohmann_json)
  add_library(${library} INTERFACE IMPORTED GLOBAL)
endforeach()
# Without std::locale, which would bring 150 KB with it.
target_compile_definitions(fmt::fmt INTERFACE FMT_HEADER_ONLY "FMT_STATIC_THOUSANDS_SEPARATOR=','" FMT_USE_LONG_DOUBLE=0)
target_compile_definitions(tomlplusplus::tomlplusplus INTERFACE TOML_FLOAT_CHARCONV=1)

# Not the libraries that open files, load programs and read the clock.
file(GLOB lua ${CBCAN_LUA_SOURCE}/src/*.c)
list(FILTER lua EXCLUDE REGEX "/(lua|luac|loslib|liolib|loadlib|linit)\\.c$")
add_library(cbcan_lua STATIC ${lua})
set_source_files_properties(${lua} PROPERTIES LANGUAGE CXX)
target_include_directories(cbcan_lua SYSTEM PUBLIC ${CBCAN_LUA_SOURCE}/src)
target_compile_options(cbcan_lua PRIVATE -x c++ -w -D_WASI_EMULATED_SIGNAL "-Dl_randomizePivot()=0u" "-Dluai_makeseed(L)=0x5eedu")
add_library(PkgConfig::lua ALIAS cbcan_lua)
set(lua_FOUND TRUE)
