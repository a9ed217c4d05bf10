// SPDX-License-Identifier: Apache-2.0
/// \file
/// The end of an MCAP file: footer, and what of its summary helps to read the rest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include <wheelwright/logs/mcap_file.hpp>
#include <wheelwright/logs/mcap_types.hpp>

namespace wheelwright::mcap {

/// What the end of a file says.
struct Summary {
  bool has_footer = false;  ///< footer and trailing magic are there
  bool usable = false;      ///< and a summary which is whole: its checksum is right, or it has none and can be parsed
  std::uint64_t data_end = 0;  ///< where the data section ends; the size of the file where that is not known
  bool chunked = false;        ///< the summary has an index of chunks
  std::uint32_t data_crc = 0;  ///< CRC-32 of the file up to the data end record; 0 where there is none
  std::map<std::uint16_t, McapSchema> schemas;
  std::map<std::uint16_t, McapChannel> channels;
  std::optional<std::uint64_t> messages;  ///< of the statistics
  std::uint64_t defect_offset = 0;        ///< where the defect is
  std::uint64_t defect_bytes = 0;         ///< how many bytes are not used for it
  std::string defect;                     ///< why the summary that is there is not usable; empty otherwise
};

/// Reads the end of `file`. A summary of more than `limit` bytes is not read.
[[nodiscard]] Summary read_summary(WindowedFile& file, std::size_t limit);

}  // namespace wheelwright::mcap
