// SPDX-License-Identifier: Apache-2.0
/// \file
/// The constants of the torque filter.
#pragma once

namespace wheelwright {

/// f(t) = α e^{−βt} (24) for order 1; f₂ = f * f = α² t e^{−βt} for order 2, which works on wheel angles.
struct FilterDesign {
  int order = 2;         ///< 1 (the paper's) or 2
  double alpha = 20.0;   ///< α, 1/s
  double beta = 20.0;    ///< β, 1/s
  double settle = 12.0;  ///< order 2 on angles: rows before settle/β from the start of a segment are dropped (unless it
                         ///< begins at standstill), since they hold the error of the first angle difference with weight
                         ///< α² t e^{−βt}; 12 leaves 7e-5 of it

  /// Gain at frequency zero: (α/β)^order.
  [[nodiscard]] double static_gain() const;
  /// Time by which slow signals are delayed, s: order/β.
  [[nodiscard]] double delay() const;
};

/// Throws InvalidArgument, naming the field, unless order is 1 or 2, α and β are finite and > 0, and settle >= 0.
void validate(const FilterDesign& design);

}  // namespace wheelwright
