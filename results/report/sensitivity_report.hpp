// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a sensitivity study, and its drawings as SVG. All of them tell without colour: by place, length,
/// filling, mark or print. Labels are plain text; it is escaped here. A drawing without a finite number to show is an
/// empty string.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "results/report/page.hpp"
#include "study/bound_derivatives.hpp"
#include "study/global_sensitivity.hpp"
#include "study/study.hpp"

namespace wheelwright::report {

/// An axis: what it shows and its unit (empty for pure numbers).
struct AxisLabel {
  std::string name = {};
  std::string unit = {};
};

/// One bar for each input about the quantity's nominal value, the largest swing on top, at most `most`: pale towards
/// the value at the input's lower end, full towards that at its upper end, a thin line over the whole range of values
/// where they go beyond both. `inputs` names them in the design's order, with their ranges if wanted.
[[nodiscard]] std::string tornado(const study::OneAtATime& study, const std::vector<std::string>& inputs,
                                  const AxisLabel& quantity, std::size_t most = 16);

/// A quantity over one input: `x` (ascending, logarithmic where told and positive) against `y`, both in their units,
/// broken where y is not finite; a ring at the nominal point, if that is finite.
[[nodiscard]] std::string sensitivity_curve(const Eigen::VectorXd& x, const Eigen::VectorXd& y, double nominal_x,
                                            double nominal_y, bool logarithmic, const AxisLabel& input,
                                            const AxisLabel& quantity);

/// Two bars for each input, the first-order index full and the total index pale, with their intervals as whiskers, the
/// largest total index on top, at most `most`. Empty unless the indices were estimated.
[[nodiscard]] std::string sobol_bars(const study::SobolIndices& indices, const std::vector<std::string>& inputs,
                                     std::size_t most = 16);

/// σ over μ*, with μ*'s interval as whiskers, a number at each point and the names beside; above the line σ = μ* an
/// effect changes as much as it is large (interactions, or curvature).
[[nodiscard]] std::string morris_scatter(const std::vector<study::ElementaryEffects>& effects,
                                         const std::vector<std::string>& inputs, const AxisLabel& quantity);

/// A map over two inputs, `x` and `y` being their values in their units at the map's coordinates: the darker a cell,
/// the larger the quantity, on a linear scale whose ends are written out; cells without a value are crossed.
[[nodiscard]] std::string sensitivity_map(const study::GridMap& map, const Eigen::VectorXd& x, const Eigen::VectorXd& y,
                                          const AxisLabel& x_label, const AxisLabel& y_label,
                                          const AxisLabel& quantity);

/// One self-contained HTML page: what matters most for each quantity in words, tornado charts and curves, shares of the
/// variance, elementary effects, maps, the bounds' derivatives and where there are none, and what could not be
/// evaluated.
[[nodiscard]] std::string sensitivity_report(const study::Study& study, const study::StudyResult& result,
                                             const std::optional<study::LocalSensitivity>& local,
                                             const std::vector<std::string>& notes, const ReportContext& context);

}  // namespace wheelwright::report
