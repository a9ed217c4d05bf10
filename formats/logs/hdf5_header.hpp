// SPDX-License-Identifier: Apache-2.0
/// \file
/// Object headers of HDF5 files, looked at before the library decodes them.
#pragma once

#include <cstdint>
#include <string>

#include "formats/logs/mcap_format.hpp"

namespace wheelwright::logs::hdf5 {

/// Sizes that a file gives to its offsets and lengths, bytes.
struct FieldSizes {
  std::size_t offset = 8;
  std::size_t length = 8;
};

/// Why the dataset whose object header stands at the byte `address` of `file` must not be opened: the library (1.10.8)
/// divides by the size of a chunk without dimensions or with a side of 0, and reads beyond an attribute. Empty where
/// nothing speaks against it; what is damaged otherwise is left to the library. The headers are those of "HDF5 File
/// Format Specification", version 3.0, sections IV.A.1, IV.A.2.b, i and m.
[[nodiscard]] std::string header_defect(mcap::WindowedFile& file, std::uint64_t address, FieldSizes sizes);

}  // namespace wheelwright::logs::hdf5
