# SPDX-License-Identifier: Apache-2.0
#
# cmake -DRUN="mpirun;-n;2;killed_rank" -DFILE=store [-DRANKS="0;1"] -P killed.cmake
#
# A rank is killed in the middle of a run; the next run has the results that were put, and ends with all of them.
foreach(rank IN LISTS RANKS)
  file(REMOVE ${FILE} ${FILE}-wal ${FILE}-journal)
  execute_process(COMMAND ${RUN} ${FILE} ${rank} RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET TIMEOUT 60)
  if(result EQUAL 0)
    message(FATAL_ERROR "rank ${rank} was not killed")
  endif()
  # mpirun may come back before the last of its processes is gone.
  foreach(attempt RANGE 20)
    execute_process(COMMAND ${RUN} ${FILE} -1 RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE error
      TIMEOUT 60)
    if(result EQUAL 0 OR NOT error MATCHES "another process")
      break()
    endif()
    execute_process(COMMAND ${CMAKE_COMMAND} -E sleep 0.2)
  endforeach()
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "after rank ${rank} was killed: ${result}\n${output}\n${error}")
  endif()
  if(NOT output MATCHES "found ([0-9]+), evaluated ([0-9]+)")
    message(FATAL_ERROR "unexpected: ${output}")
  endif()
  math(EXPR sum "${CMAKE_MATCH_1} + ${CMAKE_MATCH_2}")
  if(NOT sum EQUAL 300 OR CMAKE_MATCH_1 EQUAL 0 OR CMAKE_MATCH_2 EQUAL 0)
    message(FATAL_ERROR "rank ${rank}: ${output}")
  endif()
  message(STATUS "rank ${rank} killed, then: ${output}")
endforeach()
