# SPDX-License-Identifier: Apache-2.0
#
# cmake -DBUILD=build tree -DSCRATCH=directory -DCOMPILER=c++ [-DFLAGS=...] [-DPROGRAM=wheelwright] -P run.cmake
#
# Installs the build tree into a scratch prefix, then configures, builds and runs the project beside this file with
# nothing but that prefix: a user of the modules core and model, and a monitor of detector and robots, which must ask
# for and link none of FORBIDDEN and, with the program given, sees what `wheelwright detect` sees.
set(FORBIDDEN ceres nlopt hdf5 sqlite)
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
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS} -DCMAKE_PREFIX_PATH=${SCRATCH}/prefix
  -DCMAKE_DISABLE_FIND_PACKAGE_Ceres=ON -DCMAKE_DISABLE_FIND_PACKAGE_NLopt=ON)
run(${CMAKE_COMMAND} --build ${SCRATCH}/build)
run(${SCRATCH}/build/consumer)

execute_process(COMMAND ninja -C ${SCRATCH}/build -t commands monitor OUTPUT_VARIABLE commands RESULT_VARIABLE result)
string(REGEX MATCH "[^\n]*-o monitor [^\n]*" link_line "${commands}")
file(READ ${SCRATCH}/build/CMakeCache.txt cache)
if(result OR NOT link_line MATCHES "libwheelwright_detector")
  message(FATAL_ERROR "the link line of the monitor was not found")
endif()
foreach(name IN LISTS FORBIDDEN)
  string(TOLOWER "${link_line}" line)
  if(line MATCHES "${name}")
    message(FATAL_ERROR "a monitor links ${name}: ${link_line}")
  endif()
  if(cache MATCHES "\n[A-Z0-9]*${name}[A-Za-z0-9_]*_(FOUND|LIBRARIES):")
    message(FATAL_ERROR "find_package(Wheelwright COMPONENTS detector robots) looked for ${name}")
  endif()
endforeach()
if(PROGRAM)
  get_filename_component(source ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
  set(examples ${source}/examples)
  run(${PROGRAM} commission ${examples}/healthy.csv.gz --robot ${examples}/robot.yaml --out ${SCRATCH}/model --quiet)
  foreach(drive healthy fault)
    run(${PROGRAM} simulate ${examples}/scenarios/${drive}.yaml --out ${SCRATCH}/${drive}.csv)
    execute_process(COMMAND ${PROGRAM} detect ${SCRATCH}/${drive}.csv --model ${SCRATCH}/model/model.json --quiet
      OUTPUT_QUIET RESULT_VARIABLE expected)
    execute_process(COMMAND ${SCRATCH}/build/monitor ${SCRATCH}/model/model.json ${SCRATCH}/${drive}.csv
      RESULT_VARIABLE seen)
    if(NOT seen EQUAL expected)
      message(FATAL_ERROR "${drive}: the monitor ends with ${seen}, the program with ${expected}")
    endif()
    list(APPEND ends ${seen})
  endforeach()
  if(NOT ends STREQUAL "0;1")
    message(FATAL_ERROR "a healthy drive and a fault end with ${ends}")
  endif()
endif()

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
