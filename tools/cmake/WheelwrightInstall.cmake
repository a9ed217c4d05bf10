# SPDX-License-Identifier: Apache-2.0
#
# The package that find_package(Wheelwright) finds, in the build tree's install tree.
include(CMakePackageConfigHelpers)
set(WHEELWRIGHT_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/Wheelwright)
install(EXPORT WheelwrightTargets NAMESPACE Wheelwright:: DESTINATION ${WHEELWRIGHT_CMAKE_DIR}
  COMPONENT development)
get_property(WHEELWRIGHT_INSTALLED_MODULES GLOBAL PROPERTY WHEELWRIGHT_MODULES)
list(TRANSFORM WHEELWRIGHT_INSTALLED_MODULES REPLACE "^wheelwright_" "")
configure_package_config_file(tools/cmake/WheelwrightConfig.cmake.in ${CMAKE_BINARY_DIR}/WheelwrightConfig.cmake
  INSTALL_DESTINATION ${WHEELWRIGHT_CMAKE_DIR})
# Headers, with the includes that a program writes.
get_property(headers GLOBAL PROPERTY WHEELWRIGHT_HEADERS)
list(JOIN headers "\n" headers)
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/headers.txt CONTENT "${headers}\n" @ONLY)
install(CODE "set(SOURCE \"${PROJECT_SOURCE_DIR}\")
set(HEADERS \"${CMAKE_BINARY_DIR}/headers.txt\")
set(OUT \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}\")
include(\"${CMAKE_CURRENT_LIST_DIR}/InstalledHeaders.cmake\")" COMPONENT development)
# Below 1.0 a minor version may change the interface.
write_basic_package_version_file(${CMAKE_BINARY_DIR}/WheelwrightConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/WheelwrightConfig.cmake ${CMAKE_BINARY_DIR}/WheelwrightConfigVersion.cmake
  tools/cmake/WheelwrightDependencies.cmake DESTINATION ${WHEELWRIGHT_CMAKE_DIR} COMPONENT development)
# Debian's packages have their copyright file instead (WheelwrightPackage.cmake).
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT licence)
