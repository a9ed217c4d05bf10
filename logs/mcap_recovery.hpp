// SPDX-License-Identifier: Apache-2.0
/// \file
/// Footer and summary of an MCAP file, and resumption behind a damaged place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <wheelwright/logs/mcap_format.hpp>

namespace wheelwright::logs::mcap {

/// Summary at the end of a file.
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

/// The data section of a file.
struct DataSection {
  std::uint64_t end = 0;      ///< where it ends, or the file
  bool cut_off = false;       ///< the file has no footer: records may go beyond the end
  std::size_t max_bytes = 0;  ///< longest record that is looked for
};

/// True if a record of a data section may begin at `offset`: the end of the section, or an opcode with a length that
/// fits (in a file that is cut off also a known opcode with a length within max_bytes). Bytes at random look like that
/// in one case of 10⁹ or less, but for the last eight bytes of a file that is cut off.
[[nodiscard]] bool begins_record(WindowedFile& file, const DataSection& section, std::uint64_t offset);

/// True if a record whose own length is damaged may begin at `offset`: a message on a channel for which `messages`
/// holds, or the data end record at the end of the section. Bytes at random look like that in one case of 10⁵ or less.
[[nodiscard]] bool begins_damaged_record(WindowedFile& file, const DataSection& section, std::uint64_t offset,
                                         const std::function<bool(std::uint16_t)>& messages);

/// End of the record at `offset` whose head says that its content has `length` bytes, and whose content says that it
/// has `known` (more where fields were added that this reader does not know). When the two differ, the one behind which
/// a record begins is right, the content's before the head's; nothing when neither is.
[[nodiscard]] std::optional<std::uint64_t> settled_end(WindowedFile& file, const DataSection& section,
                                                       std::uint64_t offset, std::uint64_t length, std::uint64_t known);

/// The first offset >= `from` at which reading can go on, or the end of the section: a chunk record whose two lengths
/// agree and whose compression is known; where `messages` is given, also a message record of at most max_bytes on a
/// channel for which it holds, with two more records behind it. Leaves behind what it has searched.
[[nodiscard]] std::uint64_t find_record(WindowedFile& file, const DataSection& section, std::uint64_t from,
                                        const std::function<bool(std::uint16_t)>& messages);

}  // namespace wheelwright::logs::mcap
