// SPDX-License-Identifier: Apache-2.0
/// \file
/// The loops over many rows, for the vector units that the processor has.
///
/// Every row is computed by the same sequence of operations in its own lane, without fused multiply-add: all variants
/// give the same digits. Matrices are stored by columns, `stride` apart; the number of rows is a multiple of kLanes,
/// padded with rows that never matter (a = 0, b = +infinity).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace wheelwright::bounds::kernels {

/// Rows are padded to a multiple of this.
inline constexpr std::size_t kLanes = 8;
/// Rows that scan() looks at together; its results are sized for whole tiles.
inline constexpr std::size_t kTile = 64;

/// Rows a·x <= b by columns: a(i, j) = a[j·stride + i].
struct Rows {
  const double* a = nullptr;
  std::size_t stride = 0;
  std::size_t m = 0;  ///< rows, padding included
  std::size_t p = 0;  ///< columns
  const double* b = nullptr;
};

/// A box in other coordinates: θ = centre + T z with |z_k| <= half_k.
struct Oblique {
  const double* centre = nullptr;     ///< p numbers
  const double* half = nullptr;       ///< p numbers
  const double* transform = nullptr;  ///< T by columns, p × p
};

/// Points inside a box.
struct Points {
  const double* centre = nullptr;  ///< of the box, p numbers
  const double* half = nullptr;    ///< its half-widths, p numbers
  const double* least = nullptr;   ///< the smallest |θ_j| in it, p numbers
  const double* points = nullptr;  ///< p numbers each, one point after the other
  std::size_t count = 0;           ///< how many
  double share = 1.0;              ///< of what is allowed, that a row may come to
};

/// A row and a number.
struct Found {
  std::size_t row = 0;
  double value = 0.0;
};

/// Rows |y − Yθ| <= dy + Σ dY|θ|, unpadded.
struct Slabs {
  const double* const* Y = nullptr;   ///< p columns
  const double* const* dY = nullptr;  ///< p columns, or null where all are zero
  const double* y = nullptr;
  const double* dy = nullptr;
  std::size_t n = 0;  ///< rows
  std::size_t p = 0;
};

/// One variant of all loops.
struct Table {
  const char* name;  ///< "baseline", "avx2" or "avx512"
  /// out_i = b_i − a_i·x.
  void (*slack)(const Rows& rows, const double* x, double* out);
  /// The first row with the largest a_i·x − b_i; value −infinity without rows.
  Found (*most_violated)(const Rows& rows, const double* x);
  /// The first row with the smallest slack_i / (a_i·d) among those with a_i·d > pivot, slack taken as >= 0; `along`
  /// receives a_i·d. value +infinity where there is none.
  Found (*first_blocking)(const Rows& rows, const double* slack, const double* d, double pivot, double* along);
  /// Numbers of the rows without |y − Y·centre| + Σ|Y_j| half_j <= floor + dy + Σ dY_j least_j, ascending; how many.
  /// With `oblique`, unless null, rows with |y − Y·c| + Σ|(YT)_k| half_k <= floor + dy + Σ dY_j least_j for its box are
  /// left out too. Rows that hold a NaN are among them. `found` has room for n. `peaks`, unless null: p + 1 numbers
  /// that are raised to the largest |Y_j| of all rows, and to the largest |y|.
  std::size_t (*scan)(const Slabs& slabs, const double* centre, const double* half, const double* least,
                      const Oblique* oblique, double floor, std::uint32_t* found, double* peaks);
  /// Numbers of the rows without |y − Y·x| <= share (dy + Σ dY_j |x_j|) for all points x, ascending; how many. Rows
  /// that hold a NaN are among them. `found` has room for n. `open`, unless null, one for every kLanes rows: where it
  /// is 0 they are not looked at, and it is set to 0 where the box implies all of them. `most`, unless null, is raised
  /// to the largest Σ (|Y_j| + dY_j) half_j / (dy + Σ dY_j least_j) of the rows that it does not imply. Those that it
  /// does are never among the numbers.
  std::size_t (*examine)(const Slabs& slabs, const Points& at, std::uint32_t* found, unsigned char* open, double* most);
};

/// The variants that this processor can run, slowest first; the first is always there.
[[nodiscard]] std::span<const Table* const> available();
/// The last of them.
[[nodiscard]] const Table& best();

}  // namespace wheelwright::bounds::kernels
