# SPDX-License-Identifier: Apache-2.0
include(CMakePackageConfigHelpers)
set(WHEELWRIGHT_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/Wheelwright)
install(EXPORT WheelwrightTargets NAMESPACE Wheelwright:: DESTINATION ${WHEELWRIGHT_CMAKE_DIR})
file(WRITE ${CMAKE_BINARY_DIR}/WheelwrightConfig.cmake
"include(CMakeFindDependencyMacro)
include(\${CMAKE_CURRENT_LIST_DIR}/WheelwrightDependencies.cmake)
include(\${CMAKE_CURRENT_LIST_DIR}/WheelwrightTargets.cmake)
")
write_basic_package_version_file(${CMAKE_BINARY_DIR}/WheelwrightConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/WheelwrightConfig.cmake ${CMAKE_BINARY_DIR}/WheelwrightConfigVersion.cmake
  ${CMAKE_CURRENT_SOURCE_DIR}/cmake/WheelwrightDependencies.cmake DESTINATION ${WHEELWRIGHT_CMAKE_DIR})
