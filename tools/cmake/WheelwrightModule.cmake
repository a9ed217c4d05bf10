# SPDX-License-Identifier: Apache-2.0
#
# wheelwright_module(NAME [PROGRAM_ONLY] [WORDS] [HEADERS h...] [SHARED h...] [SOURCES s...] [FIRST s...]
#                  [HOT s...] [BATCH n] [USES module...] [FIRST_USES module...] [LINK lib...] [LINK_PRIVATE lib...])
#
# One target per module: wheelwright_NAME, alias Wheelwright::NAME. Sources here include a header by its path from the
# root of the repository, "NAME/x.hpp"; programs that use the library include <wheelwright/NAME/x.hpp>, in the build
# tree by a header that forwards to it. HEADERS are installed, SHARED are for the modules above only
# (tools/check_layers.py); what stands in neither is the module's own. PROGRAM_ONLY serves our own programs and is not
# installed. In a release WORDS, which says and writes what others found, is optimised for the time of compilation
# (-O1), other modules at -O2, and the sources named after HOT at -O3. BATCH: so many sources are compiled as one, where
# a dozen would take longer than 25 s. FIRST are the sources that the program of the first half of the build needs
# (app/CMakeLists.txt); they do not stand after SOURCES. They are compiled once, into a library wheelwright_NAME_first,
# and their objects are in the module's own library, too. FIRST_USES are the modules that they use; of a module that has
# FIRST sources itself, these alone.

# Of what names none: the modules are `development`.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME program)
set(WHEELWRIGHT_FORWARDS ${CMAKE_BINARY_DIR}/include)
set(WHEELWRIGHT_WARNINGS -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Werror)
if(CMAKE_UNITY_BUILD)
  # What stands in an unnamed namespace of one file looks like a header's to GCC.
  list(APPEND WHEELWRIGHT_WARNINGS $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()

# What stands between a mistake of ours and somebody who wants to make use of it: for what reads bytes of others, in
# releases.
set(WHEELWRIGHT_HARDENING "")
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_SYSTEM_NAME STREQUAL Linux)
  set(WHEELWRIGHT_HARDENING -fstack-protector-strong -fstack-clash-protection -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
    list(APPEND WHEELWRIGHT_HARDENING -fcf-protection)
  endif()
endif()

# The last -O counts. Results do not depend on it: no fused operations, no -ffast-math.
function(wheelwright_words target)
  target_compile_options(${target} PRIVATE "$<$<CONFIG:Release>:-O1;${WHEELWRIGHT_HARDENING}>")
endfunction()

# What nearly every source includes is read once. Only where sources are compiled by the dozen: elsewhere each shows by
# itself that it includes what it needs. Macros that are set for some targets must not matter in `HEADERS`. What is for
# EXECUTABLES is compiled as these are, else as libraries (-fPIC). GCC takes the level of optimisation from the
# precompiled header and not from the command line: WORDS is for what is compiled at -O1.
function(wheelwright_precompiled name)
  cmake_parse_arguments(PCH "EXECUTABLES;WORDS" "" "HEADERS;LINK" ${ARGN})
  if(NOT CMAKE_UNITY_BUILD OR NOT CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    return()
  endif()
  file(WRITE ${CMAKE_BINARY_DIR}/${name}.cpp "")
  add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE ${PCH_LINK})
  target_compile_features(${name} PRIVATE cxx_std_20)
  target_compile_options(${name} PRIVATE ${WHEELWRIGHT_WARNINGS} -ffp-contract=off)
  if(PCH_WORDS)
    wheelwright_words(${name})
  else()
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O2>)
  endif()
  if(NOT PCH_EXECUTABLES)
    set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  endif()
  target_precompile_headers(${name} PRIVATE ${PCH_HEADERS})
endfunction()

function(wheelwright_use_precompiled target name)
  if(TARGET ${name})
    target_precompile_headers(${target} REUSE_FROM ${name})
  endif()
endfunction()

# How the sources of a module are compiled. MODULE_… are the arguments of wheelwright_module().
macro(wheelwright_compile_module target)
  # No fused multiply-add: batch and streaming, and every machine, give the same digits.
  target_compile_options(${target} PRIVATE ${WHEELWRIGHT_WARNINGS} -ffp-contract=off)
  if(MODULE_WORDS)
    wheelwright_words(${target})
    wheelwright_use_precompiled(${target} wheelwright_words_pch)
  else()
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O2>)
    wheelwright_use_precompiled(${target} wheelwright_pch)
  endif()
  if(MODULE_BATCH)
    set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE ${MODULE_BATCH})
  endif()
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
endmacro()

# The library of a module's FIRST sources.
macro(wheelwright_first_of_module name)
  add_library(wheelwright_${name}_first STATIC ${MODULE_FIRST})
  add_library(Wheelwright::${name}_first ALIAS wheelwright_${name}_first)
  wheelwright_compile_module(wheelwright_${name}_first)
  target_compile_features(wheelwright_${name}_first PUBLIC cxx_std_20)
  foreach(module IN LISTS MODULE_FIRST_USES)
    if(TARGET wheelwright_${module}_first)
      target_link_libraries(wheelwright_${name}_first PUBLIC Wheelwright::${module}_first)
    else()
      target_link_libraries(wheelwright_${name}_first PUBLIC Wheelwright::${module})
    endif()
  endforeach()
  target_link_libraries(wheelwright_${name}_first PUBLIC ${MODULE_LINK} PRIVATE ${MODULE_LINK_PRIVATE})
endmacro()

function(wheelwright_module name)
  cmake_parse_arguments(MODULE "PROGRAM_ONLY;WORDS" "BATCH"
    "HEADERS;SHARED;SOURCES;FIRST;HOT;USES;FIRST_USES;LINK;LINK_PRIVATE" ${ARGN})
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  foreach(header IN LISTS MODULE_HEADERS MODULE_SHARED)
    if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${header})
      message(FATAL_ERROR "${folder}/CMakeLists.txt names ${header}, which is not there")
    endif()
  endforeach()
  foreach(header IN LISTS MODULE_HEADERS)
    file(CONFIGURE OUTPUT ${WHEELWRIGHT_FORWARDS}/wheelwright/${folder}/${header}
      CONTENT "#include \"${folder}/${header}\"\n" @ONLY)
  endforeach()
  list(TRANSFORM MODULE_USES PREPEND Wheelwright::)

  set(target wheelwright_${name})
  if(MODULE_FIRST)
    wheelwright_first_of_module(${name})
    list(APPEND MODULE_SOURCES $<TARGET_OBJECTS:wheelwright_${name}_first>)
  endif()
  if(MODULE_SOURCES)
    set(scope PUBLIC)
    add_library(${target} ${MODULE_SOURCES})
    set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX)  # of a library of nothing but FIRST sources, too
    wheelwright_compile_module(${target})
    set_source_files_properties(${MODULE_HOT} PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:-O3>
      SKIP_PRECOMPILE_HEADERS ON)
  else()
    set(scope INTERFACE)
    add_library(${target} INTERFACE)
  endif()
  add_library(Wheelwright::${name} ALIAS ${target})
  target_include_directories(${target} INTERFACE $<BUILD_INTERFACE:${WHEELWRIGHT_FORWARDS}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_options(${target} INTERFACE "$<BUILD_INTERFACE:SHELL:-iquote ${PROJECT_SOURCE_DIR}>")
  target_compile_features(${target} ${scope} cxx_std_20)
  target_link_libraries(${target} ${scope} ${MODULE_USES} ${MODULE_LINK})
  if(MODULE_LINK_PRIVATE)
    target_link_libraries(${target} PRIVATE ${MODULE_LINK_PRIVATE})
  endif()
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  if(MODULE_PROGRAM_ONLY)
    return()
  endif()
  set_property(GLOBAL APPEND PROPERTY WHEELWRIGHT_MODULES ${target})
  set_property(GLOBAL APPEND PROPERTY WHEELWRIGHT_FOLDERS ${folder})
  list(TRANSFORM MODULE_HEADERS PREPEND ${folder}/)
  set_property(GLOBAL APPEND PROPERTY WHEELWRIGHT_HEADERS ${MODULE_HEADERS})
  install(TARGETS ${target} EXPORT WheelwrightTargets ARCHIVE COMPONENT development LIBRARY COMPONENT development)
endfunction()
