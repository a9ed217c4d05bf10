// SPDX-License-Identifier: Apache-2.0
#include "gap/causes/fast_band.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "gap/rows/block_gram.hpp"
#include "gap/rows/drive.hpp"

namespace wheelwright::gap {
namespace {

using Signal = Eigen::VectorXd;

// f₂ at `fast` less f₂ at `slow`: nothing of what is constant.
struct Band {
  double slow = 0.0, fast = 0.0;
};

Signal banded(const Drive& drive, const Band& band, const Signal& signal) {
  return filtered(drive, band.fast, signal) - filtered(drive, band.slow, signal);
}

Signal banded_rate(const Drive& drive, const Band& band, const Signal& signal) {
  return filtered_rate(drive, band.fast, signal) - filtered_rate(drive, band.slow, signal);
}

std::vector<Eigen::Index> band_rows(const Drive& drive, const Band& band, double row_step) {
  const Mask use = settled(drive, band.slow) && moving(drive, band.slow);
  return rows_apart(drive, use, row_step, band.fast);
}

// Column `column` in the band, one part for each output.
std::vector<Signal> parts_of(const Drive& drive, const Band& band, const std::vector<Eigen::Index>& rows,
                             const Column& column) {
  std::vector<Signal> parts(drive.model.n());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    Signal sum = Signal::Zero(drive.rows());
    if (i < column.effort.size() && column.effort[i].size() > 0) {
      sum += banded(drive, band, column.effort[i]);
    }
    if (i < column.effort_rate.size() && column.effort_rate[i].size() > 0) {
      sum += banded_rate(drive, band, column.effort_rate[i]);
    }
    parts[i] = picked(sum, rows);
  }
  return parts;
}

// Efforts in the band, with the columns of θ, the clocks and `effects`.
std::vector<RowSpace> band_spaces(const Drive& drive, const Band& band, const std::vector<Eigen::Index>& rows,
                                  const std::vector<FittedEffect>& effects) {
  const std::vector<Signal> upper = filtered_outputs(drive, band.fast), lower = filtered_outputs(drive, band.slow);
  const auto Y_upper = filtered_regressor(drive, band.fast), Y_lower = filtered_regressor(drive, band.slow);
  std::vector<RowSpace> spaces(drive.model.n());
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    spaces[i].name = drive.model.outputs[i];
    spaces[i].t = picked(drive.t, rows);
    spaces[i].response = picked(upper[i] - lower[i], rows);
    for (std::size_t j = 0; j < Y_upper.size(); ++j) {
      spaces[i].columns.push_back(Y_upper[j][i].size() > 0 ? picked(Y_upper[j][i] - Y_lower[j][i], rows) : Signal());
    }
  }
  add_column(spaces, parts_of(drive, band, rows, clock_column(drive)));
  for (const FittedEffect& effect : effects) {
    for (const Column& column : effect.effect.columns(drive, effect.shape)) {
      add_column(spaces, parts_of(drive, band, rows, column));
    }
  }
  return spaces;
}

// Rows within `after` of a sign change of one of the joints' `signal`s.
Mask after_sign_changes(const Drive& drive, const std::vector<Signal>& signals, double after) {
  Mask mask = Mask::Constant(drive.rows(), false);
  const auto length = static_cast<Eigen::Index>(std::lround(after / drive.step));
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (const Signal& signal : signals) {
      for (Eigen::Index k = first + 1; k < last; ++k) {
        if (signal[k] * signal[k - 1] < 0.0) {
          mask.segment(k, std::min(length, last - k)) = true;
        }
      }
    }
  }
  return mask;
}

// Smoothed over `window` s, more than the drive's own signals: their noise would change its sign at will.
Signal smoothed(const Drive& drive, const Signal& signal, double window) {
  const auto width = 2 * static_cast<std::size_t>(std::lround(0.5 * window / drive.step)) + 1;
  Signal smooth(signal.size()), slope(signal.size());
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    const auto at = static_cast<std::size_t>(first), count = static_cast<std::size_t>(last - first);
    smooth_quadratic(std::span(signal.data() + at, count), width, std::span(smooth.data() + at, count),
                     std::span(slope.data() + at, count));
  }
  return smooth;
}

// How fast the joints' torque changes: the sum of squares of its steps over the last `after` s. Over so wide a window
// that neither play's impact nor its missing torque adds to it.
Signal slew_of(const Drive& drive, double after) {
  constexpr double kWindow = 0.6;  // s
  const Eigen::Index back = std::max<Eigen::Index>(1, std::lround(after / drive.step));
  Signal slew = Signal::Zero(drive.rows());
  for (const JointSignals& joint : drive.joints) {
    const Signal effort = smoothed(drive, joint.effort, kWindow);
    for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
      const auto [first, last] = drive.segment(s);
      double sum = 0.0;
      const auto step = [&, begin = first](Eigen::Index k) {
        return k > begin ? std::pow(effort[k] - effort[k - 1], 2) : 0.0;
      };
      for (Eigen::Index k = first; k < last; ++k) {
        sum += step(k) - (k - back > first ? step(k - back) : 0.0);
        slew[k] += sum;
      }
    }
  }
  return slew;
}

// Where a row lies.
struct Places {
  Mask reversal;  // just after a reversal of the torque
  Mask counts;    // not just after one of the speed
  Signal slew;    // of the torque
};

Places places_of(const Drive& drive, const std::vector<Eigen::Index>& rows, double after) {
  constexpr double kWindow = 0.15;  // s
  std::vector<Signal> efforts, speeds;
  for (const JointSignals& joint : drive.joints) {
    efforts.push_back(smoothed(drive, joint.effort, kWindow));
    speeds.push_back(joint.smooth_speed);
  }
  const Mask torque = after_sign_changes(drive, efforts, after), speed = after_sign_changes(drive, speeds, after);
  const auto count = static_cast<Eigen::Index>(rows.size());
  Places places{Mask(count), Mask(count), picked(slew_of(drive, after), rows)};
  for (std::size_t k = 0; k < rows.size(); ++k) {
    places.reversal[static_cast<Eigen::Index>(k)] = torque[rows[k]];
    places.counts[static_cast<Eigen::Index>(k)] = !speed[rows[k]];
  }
  return places;
}

// Weights that give the rows elsewhere the slews of those just after reversals: by quarters of the latter. A torque
// reverses while it changes fast, and what is wrong with its delay, its friction or its limits shows whenever it does.
Signal equal_slew_weights(const Places& places) {
  constexpr std::size_t kQuarters = 4;
  const Eigen::Index n = places.reversal.size();
  std::vector<double> after;
  for (Eigen::Index k = 0; k < n; ++k) {
    if (places.counts[k] && places.reversal[k]) {
      after.push_back(places.slew[k]);
    }
  }
  std::ranges::sort(after);
  const auto quarter_of = [&after](double slew) {
    const auto rank = static_cast<std::size_t>(std::ranges::upper_bound(after, slew) - after.begin());
    return std::min(kQuarters * rank / std::max<std::size_t>(after.size(), 1), kQuarters - 1);
  };
  std::array<double, kQuarters> after_of{}, elsewhere_of{};
  for (Eigen::Index k = 0; k < n; ++k) {
    if (places.counts[k]) {
      (places.reversal[k] ? after_of : elsewhere_of)[quarter_of(places.slew[k])] += 1.0;
    }
  }
  Signal weights = Signal::Ones(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (places.counts[k] && !places.reversal[k]) {
      const std::size_t quarter = quarter_of(places.slew[k]);
      weights[k] = after_of[quarter] / elsewhere_of[quarter];
    }
  }
  return weights;
}

// Mean squares just after reversals and elsewhere, over all rows and over equal parts of the time.
struct Contrast {
  double after = 0.0, elsewhere = 0.0, presence = 0.0;
  std::vector<double> after_of, elsewhere_of;  // parts that have rows of both
  double ratio() const { return elsewhere > 0.0 ? after / elsewhere : 1.0; }
};

Contrast contrast_of(const std::vector<RowSpace>& spaces, const std::vector<Signal>& left, const Places& places,
                     const Signal& weights, std::size_t parts) {
  constexpr double kFewest = 5.0;  // rows of a part
  Contrast contrast;
  double sums[2] = {0.0, 0.0}, counts[2] = {0.0, 0.0};
  const Eigen::Index n = places.reversal.size();
  for (std::size_t p = 0; p < parts; ++p) {
    const Eigen::Index from = n * static_cast<Eigen::Index>(p) / static_cast<Eigen::Index>(parts),
                       to = n * static_cast<Eigen::Index>(p + 1) / static_cast<Eigen::Index>(parts);
    double sum[2] = {0.0, 0.0}, count[2] = {0.0, 0.0};
    for (std::size_t i = 0; i < spaces.size(); ++i) {
      for (Eigen::Index k = from; k < to; ++k) {
        if (places.counts[k]) {
          const std::size_t side = places.reversal[k] ? 0 : 1;
          sum[side] += weights[k] * std::pow(left[i][k] / spaces[i].floor, 2);
          count[side] += weights[k];
        }
      }
    }
    for (const std::size_t side : {0, 1}) {
      sums[side] += sum[side];
      counts[side] += count[side];
    }
    if (count[0] >= kFewest && count[1] >= kFewest) {
      contrast.after_of.push_back(sum[0] / count[0]);
      contrast.elsewhere_of.push_back(sum[1] / count[1]);
    }
  }
  if (counts[0] > 0.0 && counts[1] > 0.0) {
    contrast.after = sums[0] / counts[0];
    contrast.elsewhere = sums[1] / counts[1];
    contrast.presence = counts[0] / (counts[0] + counts[1]);
  }
  return contrast;
}

// One-sided p-value that the median of `values` is not above 0, by the normal approximation.
double median_above_zero_p(const std::vector<double>& values) {
  constexpr std::size_t kFewest = 6;
  if (values.size() < kFewest) {
    return 1.0;
  }
  const Eigen::Map<const Signal> differences(values.data(), static_cast<Eigen::Index>(values.size()));
  return 0.5 * std::erfc(signed_rank(differences) / std::sqrt(2.0));
}

// The fit of all columns, and its residuals.
struct BandFit {
  BlockFit fit;
  Signal counts;  // rows of each block
  std::vector<Signal> left;
};

BandFit fit_band(const std::vector<RowSpace>& spaces, const BlockOptions& blocks) {
  Subset all;
  for (std::size_t c = 0; c < spaces.front().columns.size(); ++c) {
    all.columns.push_back(c);
  }
  const BlockGram gram(spaces, blocks);
  BandFit fitted{gram.fit(all), gram.rows(), {}};
  for (const RowSpace& space : spaces) {
    fitted.left.push_back(residual(space, all, fitted.fit.coefficients));
  }
  return fitted;
}

}  // namespace

std::optional<FastBand> look_at_fast_band(const PreparedGap& prepared, const std::vector<FittedEffect>& causes,
                                          const FastBandOptions& options) {
  constexpr double kMostOfAStep = 0.5;
  constexpr double kWide = 1.5;  // corners' ratio
  constexpr std::size_t kFewestBandRows = 500;
  constexpr std::size_t kParts = 24;
  constexpr double kNearlyAll = 0.9;
  const Drive& drive = prepared.drive;
  FastBand found;
  found.beta = std::min(options.beta, kMostOfAStep / drive.step);
  const Band band{prepared.row_options.beta, found.beta};
  if (prepared.reference != GapReference::healthy_log || !drive.has_efforts || band.fast < kWide * band.slow) {
    return std::nullopt;
  }
  const Drive& healthy = *prepared.healthy_drive;
  const std::vector<Eigen::Index> rows = band_rows(drive, band, options.row_step);
  const std::vector<Eigen::Index> healthy_rows = band_rows(healthy, band, options.row_step);
  if (rows.size() < kFewestBandRows || healthy_rows.size() < kFewestBandRows) {
    return std::nullopt;
  }
  std::vector<FittedEffect> all = robots_own(prepared.healthy);
  std::vector<RowSpace> reference = band_spaces(healthy, band, healthy_rows, all);
  const BandFit healthy_fit = fit_band(reference, options.blocks);
  all.insert(all.end(), causes.begin(), causes.end());
  std::vector<RowSpace> spaces = band_spaces(drive, band, rows, all);
  const std::vector<Signal> outputs = filtered_outputs(drive, band.fast);
  double efforts = 0.0, floor_square = 0.0;
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    const Signal& left = healthy_fit.left[i];
    const double floor = std::sqrt(left.squaredNorm() / static_cast<double>(left.size()));
    if (!(floor > 0.0)) {
      return std::nullopt;
    }
    reference[i].floor = spaces[i].floor = floor;
    floor_square += floor * floor;
    efforts += outputs[i].squaredNorm() / static_cast<double>(drive.rows());
  }
  const BandFit fitted = fit_band(spaces, options.blocks);
  found.left = fitted.fit.held_out_error;

  const Places places = places_of(drive, rows, options.after);
  const Places healthy_places = places_of(healthy, healthy_rows, options.after);
  const auto compared = [&](bool equal_slew) {
    const auto weights = [&](const Places& of) {
      return equal_slew ? equal_slew_weights(of) : Signal::Ones(of.reversal.size()).eval();
    };
    return std::pair(contrast_of(spaces, fitted.left, places, weights(places), kParts),
                     contrast_of(reference, healthy_fit.left, healthy_places, weights(healthy_places), kParts));
  };
  const auto [now, before] = compared(false);
  const auto [now_alike, before_alike] = compared(true);
  const double usual = std::max(before.ratio(), 1.0), usual_alike = std::max(before_alike.ratio(), 1.0);
  found.after_reversals = now_alike.after;
  found.elsewhere = now_alike.elsewhere;
  found.presence = now.presence;
  std::vector<double> beyond;
  for (std::size_t p = 0; p < now.after_of.size(); ++p) {
    beyond.push_back(now.after_of[p] - usual * now.elsewhere_of[p]);
  }
  const double added = now_alike.after - usual_alike * now_alike.elsewhere;
  found.play = now.ratio() > options.contrast * usual && now_alike.ratio() > options.contrast * usual_alike &&
               added > options.outweighs * (now_alike.elsewhere - 1.0) &&
               median_above_zero_p(beyond) < options.significance;
  if (efforts > 0.0) {
    found.effort_square = std::max(added, 0.0) * now.presence * floor_square / efforts;
  }
  std::size_t more = 0, blocks = 0;
  for (Eigen::Index b = 0; b < fitted.counts.size(); ++b) {
    if (fitted.counts[b] > 0.0) {
      ++blocks;
      more += fitted.fit.held_out_loss[b] / fitted.counts[b] > 1.0 ? 1 : 0;
    }
  }
  found.above =
      found.left > 1.0 + options.above && static_cast<double>(more) >= kNearlyAll * static_cast<double>(blocks);
  return found;
}

}  // namespace wheelwright::gap
