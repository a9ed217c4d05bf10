# SPDX-License-Identifier: Apache-2.0
#
# cmake -DBUILD=build tree -DSCRATCH=directory -DCOMPILER=c++ [-DFLAGS=...] -P run.cmake
#
# Installs the build tree into a scratch prefix, then configures, builds and runs the project beside this file with
# nothing but that prefix.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result)
  if(result)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "failed (${result}): ${command}")
  endif()
endfunction()

file(REMOVE_RECURSE ${SCRATCH})
set(ENV{DESTDIR})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${SCRATCH}/prefix)
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${SCRATCH}/build -G Ninja -DCMAKE_BUILD_TYPE=Release
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS} -DCMAKE_PREFIX_PATH=${SCRATCH}/prefix)
run(${CMAKE_COMMAND} --build ${SCRATCH}/build)
run(${SCRATCH}/build/consumer)

# The package names nothing in the source or build tree (a path begins after a quote, a blank or a semicolon).
file(GLOB_RECURSE installed ${SCRATCH}/prefix/*.cmake)
if(NOT installed)
  message(FATAL_ERROR "nothing was installed")
endif()
get_filename_component(source ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
foreach(file IN LISTS installed)
  file(READ ${file} text)
  foreach(before "\"" " " ";")
    string(FIND "${text}" "${before}${source}/" found)
    if(NOT found EQUAL -1)
      message(FATAL_ERROR "${file} names the source tree ${source}")
    endif()
  endforeach()
endforeach()
