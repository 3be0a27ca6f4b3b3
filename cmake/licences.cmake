# SPDX-License-Identifier: MIT
# cbcan_licences(FILE [NAME PATH]...): writes our licence and those of the other parts, by Debian's copyright files or by a path.
function(cbcan_licences file)
  file(READ ${PROJECT_SOURCE_DIR}/LICENSE text)
  string(PREPEND text "cbcan\n\n")
  while(ARGN)
    list(POP_FRONT ARGN name path)
    if(NOT IS_ABSOLUTE ${path})
      set(path /usr/share/doc/${path}/copyright)
    endif()
    file(READ ${path} licence)
    # Python's is that of a page of fmt's documentation and of LLDB's tests, which no program here contains.
    string(REGEX REPLACE "\nLicense: Python\n( [^\n]*\n)+" "\n" licence "${licence}")
    string(APPEND text "\n\n======== ${name}\n\n${licence}")
  endwhile()
  file(CONFIGURE OUTPUT ${file} CONTENT "@text@" @ONLY)
endfunction()
