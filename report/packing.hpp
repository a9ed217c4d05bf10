// SPDX-License-Identifier: Apache-2.0
/// \file
/// Series and times as text that a page unpacks (series.js): differences of integers, deflated, in base64.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace wheelwright::report {

/// A series on a grid of at most 10 000 steps: value = low + step · code, within half a step of what it was made from.
/// Code 65 535 is a gap.
///
/// `text` is a zlib stream (RFC 1950) in base64 of 2n bytes: the low bytes of all n differences, then their high bytes.
/// Differences of codes are taken `order` times modulo 2¹⁶ and stored as zigzag, 0, −1, 1, −2 … as 0, 1, 2, 3 …
struct PackedSeries {
  double low = 0.0;
  double step = 0.0;
  int order = 0;  ///< 0, 1 or 2
  std::string text;
};

/// Packs `values` to 1/20 000 of their span, or of `span` where that is larger; what is not finite becomes a gap.
[[nodiscard]] PackedSeries pack(std::span<const double> values, double span = 0.0);

/// Times as integers: t = start + tick · k. A tick is a microsecond; less where the median step is below 100 µs, more where
/// a step inside a segment exceeds 500 s.
///
/// Every segment begins with a jump {index, k}. `text` is a zlib stream in base64 of 4n bytes: second differences of k as
/// 32-bit zigzag, all lowest bytes first; at a jump 0, and the step before it counts on.
struct PackedTimes {
  double start = 0.0;  ///< s
  double tick = 1e-6;  ///< s
  std::vector<std::pair<std::size_t, std::int64_t>> jumps;
  std::string text;
};

/// Packs `t` (s, finite). `breaks`: ascending indices at which a segment starts; 0 may be among them.
[[nodiscard]] PackedTimes pack_times(std::span<const double> t, const std::vector<std::size_t>& breaks);

}  // namespace wheelwright::report
