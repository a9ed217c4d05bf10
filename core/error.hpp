// SPDX-License-Identifier: Apache-2.0
/// \file
/// Exceptions for misuse by the caller. Outcomes that depend on the data are returned, never thrown.
#pragma once

#include <stdexcept>
#include <string>

namespace wheelwright::core {

/// Base of every exception of the library.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An argument of a function is outside its documented domain (a shape, a range, a non-finite number).
class InvalidArgument : public Error {
 public:
  using Error::Error;
};

/// A file or stream holds something that cannot be used. The message names file, line or key, the value, and what was
/// expected.
class InputError : public Error {
 public:
  using Error::Error;
};

}  // namespace wheelwright::core

namespace wheelwright {
using core::Error;
using core::InputError;
using core::InvalidArgument;
}  // namespace wheelwright
