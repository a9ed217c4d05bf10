// SPDX-License-Identifier: Apache-2.0
/// \file
/// Effect of a step of any onset in the rows of the torque residual: the signature element by element, and the weights
/// of elements in a row.
#pragma once

#include <cstddef>
#include <vector>

#include "core/interval.hpp"
#include "detector/faults/reference_motion.hpp"
#include "model/fault_type.hpp"
#include "model/filter/kernel.hpp"

namespace wheelwright::detector {

/// Up to `most` instants of `motion` in the window (s) at which a row is settled, evenly spread over all of them.
[[nodiscard]] std::vector<std::size_t> settled_within(const ReferenceMotion& motion, const Interval& window,
                                                      std::size_t most);

/// Weights of the elements of a motion in its rows, one row after the other.
class RowWeights {
 public:
  /// `motion` is kept by reference.
  RowWeights(const ReferenceMotion& motion, const FilterDesign& design);

  /// Elements [first(), row) with weights weight(k), of the row at instant `row`.
  void of(std::size_t row);
  /// First instant that counts: e^-20 of its weight is left, or the segment begins with it.
  [[nodiscard]] std::size_t first() const { return first_; }
  /// Weight of the element from instant `k` to the next.
  [[nodiscard]] double weight(std::size_t k) const { return weights_[k - first_]; }

 private:
  // Of an element like `k` that came at instant `since`.
  [[nodiscard]] double of_age(std::size_t k, std::size_t row, std::size_t since) const;

  const ReferenceMotion& motion_;
  FilterDesign design_;
  filter::FilterKernel kernel_;
  std::size_t first_ = 0;
  std::vector<double> weights_;
};

/// A signature along the motion of a fault that was there before, element by element, output by output.
struct StepElements {
  std::size_t outputs = 0, columns = 0;
  std::vector<double> g1, g2;  ///< of the element from instant k to the next, integrated; instants × outputs × columns
  std::vector<double> c;       ///< alike; instants × outputs
  std::vector<double> once, twice;  ///< impulse of the motion beyond v at instant k, in g1 and g2

  /// Columns of output `i` at instant `k` of g1, g2, once or twice.
  [[nodiscard]] const double* at(const std::vector<double>& of, std::size_t k, std::size_t i) const {
    return of.data() + (k * outputs + i) * columns;
  }
};

/// The elements of `fault` along `motion`; `static_gain`: of the filter that it was read with.
[[nodiscard]] StepElements step_elements(const FaultType& fault, const Model& model, double static_gain,
                                         const ReferenceMotion& motion);

}  // namespace wheelwright::detector
