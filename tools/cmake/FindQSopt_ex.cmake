# SPDX-License-Identifier: Apache-2.0
#
# QSopt_ex, linear programs in exact rationals, the oracle of the tests: QSopt_ex_FOUND and the target
# QSopt_ex::QSopt_ex, which brings GMP and its C++ interface.
find_path(QSopt_ex_INCLUDE_DIR qsopt_ex/QSopt_ex.h)
find_path(QSopt_ex_GMP_INCLUDE_DIR gmpxx.h)
find_library(QSopt_ex_LIBRARY qsopt_ex)
find_library(QSopt_ex_GMP_LIBRARY gmp)
find_library(QSopt_ex_GMPXX_LIBRARY gmpxx)
mark_as_advanced(QSopt_ex_INCLUDE_DIR QSopt_ex_GMP_INCLUDE_DIR QSopt_ex_LIBRARY QSopt_ex_GMP_LIBRARY
  QSopt_ex_GMPXX_LIBRARY)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(QSopt_ex
  REQUIRED_VARS QSopt_ex_LIBRARY QSopt_ex_INCLUDE_DIR QSopt_ex_GMP_LIBRARY QSopt_ex_GMPXX_LIBRARY
    QSopt_ex_GMP_INCLUDE_DIR)
if(QSopt_ex_FOUND AND NOT TARGET QSopt_ex::QSopt_ex)
  add_library(QSopt_ex::QSopt_ex UNKNOWN IMPORTED)
  set_target_properties(QSopt_ex::QSopt_ex PROPERTIES IMPORTED_LOCATION ${QSopt_ex_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES "${QSopt_ex_INCLUDE_DIR};${QSopt_ex_GMP_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "${QSopt_ex_GMPXX_LIBRARY};${QSopt_ex_GMP_LIBRARY}")
endif()
