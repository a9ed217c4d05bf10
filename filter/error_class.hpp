// SPDX-License-Identifier: Apache-2.0
/// \file
/// What is assumed of sensors' errors where a guarantee holds at a stated risk.
#pragma once

#include <cstddef>

#include <wheelwright/filter/sample_weights.hpp>

namespace wheelwright::filter {

/// Errors e of one sensor: |e| <= bound always, and whatever happened up to `correlation` (s) before a sample, the mean
/// of its error is within ±bias. Nothing is said of their law. With bias = bound that is all bounded errors.
struct ErrorClass {
  double bound = 0.0;        ///< unit of the column
  double bias = 0.0;         ///< the same unit, 0 <= bias <= bound
  double correlation = 0.0;  ///< s
};

/// Those of a log's columns, independent from joint to joint.
struct ErrorClasses {
  ErrorClass motion, effort;
  double count = 0.0;          ///< rad or m, resolution of the angles: 0 where they are not rounded
  double shortest_step = 0.0;  ///< s, of the log

  /// True if some sensor's errors average out.
  [[nodiscard]] bool average() const { return motion.bias < motion.bound || effort.bias < effort.bound; }
};

/// Throws InvalidArgument, naming the field, unless numbers are as ErrorClass says.
void validate(const ErrorClasses& classes);

/// Bound on the errors' share of a sum: |share| <= straight + sqrt(2 · squares · ln(2/δ)) but for the probability δ,
/// and |share| <= worst always.
struct ErrorShare {
  double squares = 0.0;   ///< Σ (weight · bound)², times the number of samples within a correlation time
  double straight = 0.0;  ///< Σ |weight| · bias; of errors that do not average out, · bound
  double worst = 0.0;     ///< Σ |weight| · bound
};

/// What is assumed of one sample: an encoder's rounding averages out only while its wheel moves by several counts from
/// sample to sample (else a rounded angle stands still, and its error with it).
struct SampleClass {
  bool averages = false;
  double bound = 0.0, bias = 0.0;
  double multiplicity = 1.0;  ///< samples within a correlation time
};
[[nodiscard]] SampleClass sample_class(const ErrorClasses& classes, const SampleWeight& sample);

/// Counts from sample to sample from which on rounding averages out.
inline constexpr double kCountsThatAverage = 4.0;

/// Adds a sample that stands in a sum with a weight of the size `weight` >= 0.
inline void add(ErrorShare& share, const SampleClass& sample, double weight) {
  const double size = weight * sample.bound;
  share.worst += size;
  share.straight += sample.averages ? weight * sample.bias : size;
  share.squares += sample.averages ? sample.multiplicity * size * size : 0.0;
}

}  // namespace wheelwright::filter
