// SPDX-License-Identifier: Apache-2.0
/// \file
/// Minimum detectable fault at one instant: the smallest size that is certain to be detected, and the largest that is
/// certain not to be; exact, over the whole feasible set.
///
/// With P the feasible set, h its support function and θ >= 0 (other signs as ThresholdRule has them), an instant shows
/// a fault κ > 0 **for certain** when for every θ in P, every |e| <= n̄ and every |δ| <= Δ
///
///     min over P of (y + κ g1 + κ² g2) θ + κ c − n̄  >  h(y + κ s + 2Δ) + n̄      (upwards), or the mirror image
///     downwards:
///
/// Δ counts twice: once for the error of the detector's regressor, and once for the allowance of the threshold.
/// **The sizes that are certain up to a largest one κ̄ form one interval (κ°, κ̄]**, so bisection finds κ° exactly: for
/// a single θ and fixed regressor the difference f of both sides is a quadratic in κ with f(0) <= 0 (no false alarm).
/// If g2 θ >= 0 it is convex and crosses zero once, upwards. If not it is concave, and {f > 0} is an interval, which
/// holds κ̄ or is of no interest. The certain sizes are the intersection over θ; where s is not 0 the threshold's h is
/// convex in κ and g2 is 0 (validate(FaultType)), so f is concave. What is in doubt of a row (FaultRow::doubt, range,
/// read) takes a constant and a multiple of κ from f, which changes none of this.
///
/// An instant shows a fault **possibly** when some θ in P and some noise of at most q times the bounds carry it over
/// the threshold. With q = 1 every fault does: the threshold is tight, fault-free residuals reach it. With q = 0 it is
/// the smallest fault that sensors without noise could show.
#pragma once

#include <optional>

#include "detector/faults/fault_rows.hpp"
#include "detector/threshold.hpp"

namespace wheelwright::detector {

/// Minimum detectable fault sizes of one instant. One object serves one thread.
class FaultMargin {
 public:
  /// For the detector's thresholds `rule`.
  explicit FaultMargin(ThresholdRule rule) : rule_(std::move(rule)) {}

  /// True if a fault of size κ > 0 (`side` = 1) or −κ (`side` = −1) is certain to be outside [l, u] in this row.
  /// Rounding is on the safe side: true is a proof.
  [[nodiscard]] bool certain(const FaultRow& row, double kappa, double side, std::size_t channel = 0);

  /// Shortfall of a fault of that size from being certain, as a share of the threshold's width: 0 where it is certain.
  [[nodiscard]] double missing(const FaultRow& row, double kappa, double side, std::size_t channel = 0);

  /// κ° of the header's text: the fault is certain for all sizes in [κ°, largest]; nothing where `largest` is not
  /// certain. Of the size found, certain() is true; relative error 1e-9, upwards.
  [[nodiscard]] std::optional<double> smallest_certain(const FaultRow& row, double largest, double side,
                                                       std::size_t channel = 0);

  /// A size up to which no fault is seen whatever θ in P and whatever the noise of at most `share` times the bounds, in
  /// [0, largest]. Within 1e-3 of the smallest possible one where the excess grows with κ; never above it.
  [[nodiscard]] double largest_hidden(const FaultRow& row, double largest, double side, double share,
                                      std::size_t channel = 0);

  /// True if a fault of size κ on that side can be outside [l, u] in this row, for some θ in P and noise of at most
  /// `share` times the bounds. Rounding is on the safe side: false is a proof.
  [[nodiscard]] bool possible(const FaultRow& row, double kappa, double side, double share, std::size_t channel = 0);

  [[nodiscard]] const ThresholdRule& rule() const { return rule_; }

 private:
  enum class Direction { up, down };  // over u, under l

  struct Sums {
    double predicted, doubt, rounding;  // seen θ̂; of the row, for all θ; of everything compared
  };
  [[nodiscard]] Sums at(const FaultRow& row, double kappa, double side, double errors);
  // Cheap bounds from one θ of the set, and from its hull: no certain size up to κ; nothing possible up to κ.
  [[nodiscard]] bool cannot_be_certain(const FaultRow& row, double kappa, double side, Direction direction) const;
  [[nodiscard]] bool cannot_be_possible(const FaultRow& row, double kappa, double side, double share,
                                        Direction direction) const;
  [[nodiscard]] double certain_excess(const FaultRow& row, double kappa, double side, std::size_t channel,
                                      Direction direction);
  [[nodiscard]] double possible_excess(const FaultRow& row, double kappa, double side, double share,
                                       std::size_t channel, Direction direction);

  ThresholdRule rule_;
  std::vector<double> acting_, seen_, error_;
};

}  // namespace wheelwright::detector
