// SPDX-License-Identifier: Apache-2.0
/// \file
/// Part of a finding that declared errors and unknown motion between samples can explain, and that therefore does not
/// count against a model.
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "core/interval.hpp"
#include "core/log.hpp"
#include "model/filter/noise.hpp"

namespace wheelwright::commission {

/// By how much an estimate may be off without any assumption being broken, to first order.
struct Explained {
  Eigen::VectorXd in_doubt;  ///< by what motion, friction and efforts may do between samples, and by signs that samples
                             ///< leave open: that moves least squares whatever the noise is like
  Eigen::VectorXd noise;     ///< by noise inside its declared bounds with the worst of all shapes and signs
  /// s, what is left of `in_doubt` of the shift where what happens between samples in one memory of the filter has no
  /// regard to the next: three standard deviations.
  double shift_by_chance = 0.0;
};

/// Explained for least squares' estimate of each parameter (p entries) and of a constant shift of the efforts (the last
/// entry, s), over the first `most_rows` rows of `log`. `errors` are those of the rows that made the set, `box` its
/// hull. The moment at which held efforts change counts as nothing for a shift: EffortTiming::allowed has it. Zeros
/// where noise is not declared. Walks the log twice.
[[nodiscard]] Explained explained_by_errors(LogSource& log, const Setting& setting, const Fit& fit,
                                            const filter::SignalErrors& errors, const Box& box,
                                            std::size_t most_rows = 60000);

/// The first instants of `rows`, at least `most` of them where there are so many.
[[nodiscard]] RegressionBlock first_rows(core::RegressionSource& rows, std::size_t most);

}  // namespace wheelwright::commission
