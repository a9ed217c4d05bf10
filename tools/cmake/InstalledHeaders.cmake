# SPDX-License-Identifier: Apache-2.0
#
# Part of the installation: writes OUT/wheelwright/x/y.hpp for each line "x/y.hpp" of the file HEADERS, from
# SOURCE/x/y.hpp, with #include <wheelwright/x/z.hpp> in place of #include "x/z.hpp". A header that includes one of ours
# that HEADERS does not name is an error.
file(STRINGS "${HEADERS}" headers)
foreach(header IN LISTS headers)
  set(file "${OUT}/wheelwright/${header}")
  message(STATUS "Installing: ${file}")
  file(READ "${SOURCE}/${header}" text)
  string(REGEX MATCHALL "\n#include \"[^\"]+\"" includes "${text}")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE ".*\"([^\"]+)\"" "\\1" included "${include}")
    list(FIND headers "${included}" at)
    if(at EQUAL -1)
      message(FATAL_ERROR "${header} includes \"${included}\", which is not installed")
    endif()
  endforeach()
  string(REGEX REPLACE "\n#include \"([^\"]+)\"" "\n#include <wheelwright/\\1>" text "${text}")
  file(WRITE "${file}" "${text}")
  list(APPEND CMAKE_INSTALL_MANIFEST_FILES "${file}")
endforeach()
