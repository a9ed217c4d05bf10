# SPDX-License-Identifier: Apache-2.0
#
# Debian packages by CPack, one per component of the installation: `wheelwright` (program), `libwheelwright-dev`
# (development) and, where the Python package is built, `python3-wheelwright` (python). tools/package.sh makes them.
if(NOT PROJECT_IS_TOP_LEVEL OR NOT TARGET wheelwright)
  return()
endif()

# What `cmake --install` copies, and what the packages hold beside it; nothing of tests, examples and benchmarks.
get_property(modules GLOBAL PROPERTY WHEELWRIGHT_MODULES)
add_custom_target(installed)
add_dependencies(installed wheelwright ${modules})
add_custom_target(packaged)
add_dependencies(packaged installed)
if(TARGET wheelwright_shell_files)
  add_dependencies(installed wheelwright_shell_files)
  # Debian's zsh does not look where others do.
  install(FILES ${CMAKE_BINARY_DIR}/share/_wheelwright DESTINATION share/zsh/vendor-completions COMPONENT program
    EXCLUDE_FROM_ALL)
endif()

set(WHEELWRIGHT_MAINTAINER "The Wheelwright authors <wheelwright@localhost.localdomain>"
  CACHE STRING "Maintainer of the Debian packages: name <mail address>")
set(components program development)
set(names wheelwright libwheelwright-dev)

install(DIRECTORY examples/scenarios DESTINATION share/doc/wheelwright/examples COMPONENT program)
install(FILES examples/healthy.csv.gz examples/robot.yaml DESTINATION share/doc/wheelwright/examples COMPONENT program)
file(GLOB schemas CONFIGURE_DEPENDS results/*.schema.json)
install(FILES ${schemas} DESTINATION share/wheelwright/schemas COMPONENT program)

if(WHEELWRIGHT_PYTHON_BUILT)
  list(APPEND components python)
  list(APPEND names python3-wheelwright)
  add_dependencies(packaged wheelwright_python)
  # Where Debian's python3 looks; for other prefixes there is the wheel, so `cmake --install` leaves this out.
  set(destination lib/python3/dist-packages/wheelwright)
  install(TARGETS wheelwright_python DESTINATION ${destination} COMPONENT python EXCLUDE_FROM_ALL)
  install(DIRECTORY python/wheelwright/ DESTINATION ${destination} COMPONENT python EXCLUDE_FROM_ALL
    FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)
endif()

# Debian's papers. The changelog of the packaging has the date of the last commit (SOURCE_DATE_EPOCH) or of today.
set(papers ${CMAKE_BINARY_DIR}/debian)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(WRITE ${papers}/changelog.Debian
  "wheelwright (${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium

  * Made from the sources by CPack; changelog.gz tells what changed there.

 -- ${WHEELWRIGHT_MAINTAINER}  ${date}
")
execute_process(COMMAND gzip -9nc ${papers}/changelog.Debian OUTPUT_FILE ${papers}/changelog.Debian.gz)
execute_process(COMMAND gzip -9nc ${PROJECT_SOURCE_DIR}/CHANGELOG.md OUTPUT_FILE ${papers}/changelog.gz)
foreach(component name IN ZIP_LISTS components names)
  # Not with `cmake --install`: these are the packages' own.
  install(FILES tools/cmake/debian/copyright ${papers}/changelog.Debian.gz ${papers}/changelog.gz
    DESTINATION share/doc/${name} COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()

# The bill of materials; without python3 the package has none.
find_package(Python3 COMPONENTS Interpreter)
if(Python3_Interpreter_FOUND)
  execute_process(COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/check_dependencies.py
    --sbom ${papers}/sbom.cdx.json COMMAND_ERROR_IS_FATAL ANY)
  install(FILES ${papers}/sbom.cdx.json DESTINATION share/doc/wheelwright COMPONENT program EXCLUDE_FROM_ALL)
endif()

# What the installed CMake package asks for, as Debian packages: everything in tools/cmake/dependencies.json that is
# used by the library.
file(READ ${PROJECT_SOURCE_DIR}/tools/cmake/dependencies.json dependencies)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tools/cmake/dependencies.json)
string(JSON count LENGTH "${dependencies}" dependencies)
math(EXPR last "${count} - 1")
set(development "")
foreach(k RANGE ${last})
  string(JSON use GET "${dependencies}" dependencies ${k} use)
  if(NOT use STREQUAL "library")
    continue()
  endif()
  string(JSON minimum ERROR_VARIABLE none GET "${dependencies}" dependencies ${k} minimum)
  string(JSON packages LENGTH "${dependencies}" dependencies ${k} packages)
  math(EXPR packages "${packages} - 1")
  foreach(j RANGE ${packages})
    string(JSON package GET "${dependencies}" dependencies ${k} packages ${j})
    if(minimum)
      string(APPEND package " (>= ${minimum})")
    endif()
    list(APPEND development "${package}")
  endforeach()
endforeach()
list(JOIN development ", " development)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME wheelwright)
# Each package has a summary of its own, the first line of its description.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
set(CPACK_PACKAGE_CONTACT "${WHEELWRIGHT_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
  WORLD_EXECUTE)
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/tools/cmake/debian/compress.cmake)
set(CPACK_COMPONENTS_ALL ${components})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)

set(what "From a log of fault-free driving Wheelwright finds mass, inertia and
friction of a wheeled robot with guaranteed bounds, and from them
thresholds that no healthy robot exceeds; what exceeds them is a fault.
It reads rosbag2 (MCAP and SQLite), HDF5 and CSV.")

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME wheelwright)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "fault detection for wheeled robots with guaranteed thresholds
${what}

This package has the program, the log and the robot file of its
tutorial, and the schemas of its results.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libwheelwright-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${development}")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS wheelwright)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "fault detection for wheeled robots, C++ library
${what}

This package has the static libraries, the headers and the CMake
package, one target for each part: a robot that only monitors links
Wheelwright::detector.")

if(WHEELWRIGHT_PYTHON_BUILT)
  math(EXPR next "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-wheelwright)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= 3.${Python3_VERSION_MINOR}~), python3 (<< 3.${next}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS python3-matplotlib)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/tools/cmake/debian/postinst
    ${PROJECT_SOURCE_DIR}/tools/cmake/debian/prerm)
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION "fault detection for wheeled robots, Python module
${what}

This package has the module wheelwright for Python 3, which works on
NumPy arrays.")
endif()
include(CPack)
