// SPDX-License-Identifier: Apache-2.0
/// \file
/// Exceptions that travel between ranks.
#pragma once

#include <exception>
#include <string>
#include <string_view>

namespace wheelwright {

/// The exception as bytes: its kind (InputError, Error or another) and its text.
[[nodiscard]] std::string packed(const std::exception_ptr& failure);

/// The exception again: InputError, Error or std::runtime_error, "rank `rank`: " before its text. Throws InvalidArgument
/// where `bytes` is none.
[[nodiscard]] std::exception_ptr unpacked(int rank, std::string_view bytes);

}  // namespace wheelwright
