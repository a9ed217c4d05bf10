// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log of any format: what is read of it is clean.
#pragma once

#include <string>

#include <wheelwright/core/log.hpp>
#include <wheelwright/logs/log_file.hpp>

#include "fuzz.hpp"

namespace wheelwright::fuzz {

/// Reads the bytes as a log in a file with that ending. TableSource throws what is no InputError where a value is not
/// finite or time stands.
inline int read_log(const std::uint8_t* data, std::size_t size, const std::string& ending) {
  return clean([&] {
    const auto log = logs::open_log({on_disk(text_of(data, size), ending)});
    const LogTable table = core::read_all(*log);
    core::TableSource checked(table);
    require(log->report().rows == table.rows());
  });
}

}  // namespace wheelwright::fuzz
