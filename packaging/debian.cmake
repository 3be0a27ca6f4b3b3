# SPDX-License-Identifier: MIT
# cpack runs this when each package's files are in a folder: adds and changes what Debian requires.
file(GLOB packages ${CPACK_TEMPORARY_DIRECTORY}/*)
foreach(package IN LISTS packages)
  string(TOUPPER ${package} component)
  get_filename_component(component ${component} NAME)
  set(doc ${package}/usr/share/doc/${CPACK_DEBIAN_${component}_PACKAGE_NAME})
  file(MAKE_DIRECTORY ${doc})
  file(READ ${CMAKE_CURRENT_LIST_DIR}/../LICENSE license)
  string(REGEX REPLACE "\n\n" "\n.\n" license "${license}")
  string(REGEX REPLACE "\n([^\n])" "\n \\1" license "${license}")
  string(REGEX MATCH "Copyright \\(c\\) ([^\n]*)" holder "${license}")
  file(WRITE ${doc}/copyright "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\n\n"
    "Files: *\nCopyright: ${CMAKE_MATCH_1}\nLicense: Expat\n ${license}\n"
    "Files: hostsim/web/page/uPlot.*\nCopyright: 2022 Leon Sorokin\nLicense: Expat\n\n"
    "Files: nlohmann/* toml++/* fmt/*\nCopyright: 2013-2022 Niels Lohmann\n 2020-2022 Mark Gillard\n 2012-present Victor Zverovich\n"
    "License: Expat\nComment: headers of other projects that the programs are compiled with\n")
  string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)
  file(WRITE ${doc}/changelog.Debian "cbcan (${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium\n\n  * See CHANGELOG.md.\n\n"
    " -- ${CPACK_PACKAGE_CONTACT}  ${now}\n")
  file(COPY ${CMAKE_CURRENT_LIST_DIR}/../CHANGELOG.md DESTINATION ${doc})
  file(GLOB_RECURSE compressed ${package}/usr/share/man/* ${doc}/changelog.Debian)
  execute_process(COMMAND gzip -9nf ${compressed} COMMAND_ERROR_IS_FATAL ANY)
  file(GLOB archives ${package}/usr/lib/*.a ${package}/usr/lib/*/*.a)
  if(archives)
    execute_process(COMMAND strip --strip-debug --enable-deterministic-archives ${archives} COMMAND_ERROR_IS_FATAL ANY)
  endif()
endforeach()
