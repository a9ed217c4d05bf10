// SPDX-License-Identifier: Apache-2.0
/// \file
/// What is assumed of sensors' errors where a guarantee holds at a stated risk.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/limits.hpp"

namespace wheelwright::filter {

struct SampleWeight;

/// Errors e of one sensor: |e| <= bound always, and whatever happened up to `correlation` (s) before a sample, the mean
/// of its error is within ±bias, and the root of its mean square about that mean is at most `deviation`. Nothing else
/// is said of their law. With bias = bound that is all bounded errors.
struct ErrorClass {
  double bound = 0.0;                  ///< unit of the column
  double bias = 0.0;                   ///< the same unit, 0 <= bias <= bound
  double correlation = 0.0;            ///< s
  double deviation = core::kInfinity;  ///< the same unit, > 0; from the bound on it says nothing
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

/// Bound on the errors' share of a sum: what averages out may add to `straight`, and |share| <= worst always.
struct ErrorShare {
  double straight = 0.0;  ///< Σ |weight| · bias; of errors that do not average out, · bound
  double worst = 0.0;     ///< Σ |weight| · bound
};

/// What is assumed of one sample: an encoder's rounding averages out only while its wheel moves by several counts from
/// sample to sample (else a rounded angle stands still, and its error with it).
struct SampleClass {
  bool averages = false;
  double bound = 0.0, bias = 0.0;
  double deviation = 0.0;     ///< <= bound
  double multiplicity = 1.0;  ///< samples within a correlation time
};
[[nodiscard]] SampleClass sample_class(const ErrorClasses& classes, const SampleWeight& sample);
/// Class of samples whose factors are known exactly, no two of them nearer than `shortest_step` s.
[[nodiscard]] SampleClass sample_class(const ErrorClass& c, double shortest_step);

/// Counts from sample to sample from which on rounding averages out.
inline constexpr double kCountsThatAverage = 4.0;

/// Variance proxy s² of an error e that averages out: E exp(λ (e − mean)) <= exp(λ² s²/2), whatever happened before,
/// for every λ. Of all laws with that bound and deviation the one of two points, b = bound + bias and −deviation²/b,
/// has the largest generating function [boucheron2013], and that is bounded by deviation² sinh(l)/l with l = 2
/// ln(b/deviation) [kearns1998]. No larger than Hoeffding's, bound². For errors that are alike within a correlation
/// time both hold with its number of samples (Hölder's inequality).
[[nodiscard]] inline double variance_proxy(const SampleClass& sample) {
  const double most = sample.bound + sample.bias, square = sample.bound * sample.bound;
  const double deviation = sample.deviation * sample.deviation;
  const double above = (most - sample.deviation) * (most + sample.deviation) / deviation;  // (b/deviation)² − 1
  const double two =
      above > 0.0 ? 0.5 * deviation * above * (2.0 + above) / ((1.0 + above) * std::log1p(above)) : square;
  return sample.multiplicity * std::min(square, two);
}

/// The same for all |λ| <= `reach` (1/unit): the smaller of that and Bernstein's, deviation²/(1 − u/3) with u = reach ·
/// (bound + bias) [boucheron2013], for small λ next to the variance. `all`: variance_proxy(sample), which costs a
/// logarithm.
[[nodiscard]] inline double variance_proxy(const SampleClass& sample, double reach, double all) {
  const double m = sample.multiplicity, deviation = sample.deviation * sample.deviation;
  const double u = m * reach * (sample.bound + sample.bias);
  return m * deviation < all * (1.0 - u / 3.0) ? m * deviation / (1.0 - u / 3.0) : all;
}
[[nodiscard]] inline double variance_proxy(const SampleClass& sample, double reach) {
  return variance_proxy(sample, reach, variance_proxy(sample));
}

/// Adds a sample that stands in a sum with a weight of the size `weight` >= 0.
inline void add(ErrorShare& share, const SampleClass& sample, double weight) {
  const double size = weight * sample.bound;
  share.worst += size;
  share.straight += sample.averages ? weight * sample.bias : size;
}

}  // namespace wheelwright::filter
