// SPDX-License-Identifier: Apache-2.0
/// \file
/// How a residual's mean square is distributed over frequency.
#pragma once

#include <cstddef>

#include <Eigen/Core>

namespace wheelwright {

/// A one-sided power spectral density.
struct Spectrum {
  Eigen::VectorXd frequency;  ///< Hz, equally spaced, the zero left out
  Eigen::VectorXd density;    ///< (unit of the values)²/Hz
  std::size_t windows = 0;    ///< that were averaged
  /// Mean square between two frequencies, lower <= f < upper (Hz).
  [[nodiscard]] double power(double lower, double upper) const;
};

/// How it is estimated.
struct SpectrumOptions {
  double window = 20.0;   ///< s; half of it for logs shorter than two windows
  double highest = 10.0;  ///< Hz; values are averaged over cells of at most a quarter of its period
};

/// Averaged periodograms of overlapping Hann windows (Welch 1967) of `values` at the ascending times `t` (s), which may
/// have gaps: missing cells are zero, and windows with less than half of their cells are left out. No window: no
/// frequencies. Throws InvalidArgument when sizes disagree.
[[nodiscard]] Spectrum spectrum(const Eigen::VectorXd& t, const Eigen::VectorXd& values,
                                const SpectrumOptions& options = {});

/// Density at `frequency` (Hz) of white noise that passed f₂ (static gain 1, `beta` in 1/s) and has standard deviation
/// `sd` behind it: sd² (8/β) β⁴/(β² + (2πf)²)².
[[nodiscard]] double filtered_noise_density(double beta, double sd, double frequency);

}  // namespace wheelwright
