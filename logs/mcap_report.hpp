// SPDX-License-Identifier: Apache-2.0
/// \file
/// What reading an MCAP file found, and what of it could not be used: nothing is lost silently.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace wheelwright {

/// A place of the file that is damaged, cut off or beyond a limit.
struct McapDamage {
  std::uint64_t offset = 0;  ///< from the start of the file
  std::uint64_t bytes = 0;   ///< that could not be used, of the file (of an unpacked record inside a chunk);
                             ///< 0 where something is wrong and nothing was left out for it
  std::optional<std::uint64_t> messages;  ///< that were lost with them, where the file says how many
  std::string why;                        ///< what was found, and what was done
};

/// Records of kinds that this reader does not know, which the format allows; they were skipped.
struct McapUnknown {
  std::size_t count = 0;
  std::uint64_t bytes = 0;
  std::uint64_t first = 0;  ///< offset of the first (of the chunk that holds it); 0 when there is none
};

/// A file, or what was read of it so far.
struct McapReport {
  std::string path;             ///< as it was given
  std::uint64_t file_size = 0;  ///< bytes
  std::string hash;     ///< "xxh64:…" of the file (Xxh64::text) when it was asked for and the file read to its end
  std::string profile;  ///< of the header, e.g. "ros2"
  std::string library;  ///< of the header: what wrote the file

  std::uint64_t messages = 0;   ///< handed out
  std::uint64_t unchecked = 0;  ///< of these, from a chunk that is cut off or has no checksum, or from no chunk
  std::optional<std::uint64_t> promised;  ///< messages that the file says it has (its statistics)
  std::uint64_t chunks = 0;               ///< unpacked, wholly or in part
  std::uint64_t attachments = 0;          ///< skipped
  std::uint64_t metadata = 0;             ///< records of it, skipped
  McapUnknown unknown;
  bool indexed = false;   ///< a whole footer, and a summary that can be used
  bool finished = false;  ///< the file was read to its end; what follows is final

  std::vector<McapDamage> damages;  ///< in the order in which they were met, at most `kept`
  std::size_t damage_count = 0;     ///< all of them
  std::uint64_t damaged_bytes = 0;  ///< sum over all of them
  static constexpr std::size_t kept = 1000;

  /// Whether nothing was found wrong: no damage, and as many messages as were promised.
  [[nodiscard]] bool clean() const { return damage_count == 0 && (!promised || !finished || *promised == messages); }
};

/// What is not as it should be in `report`, one sentence each, naming file and offset; empty where there is nothing.
[[nodiscard]] std::vector<std::string> sentences(const McapReport& report);

}  // namespace wheelwright
