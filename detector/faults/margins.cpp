// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/margins.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "core/check.hpp"
#include "core/for_all.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "detector/events.hpp"
#include "detector/faults/fault_margin.hpp"
#include "detector/faults/fault_rows.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/threshold.hpp"

namespace wheelwright::detector {

using core::kInfinity;

namespace {

constexpr double kStill = 0.03, kStraight = 0.1, kAccelerating = 0.5;

double rms(const Eigen::MatrixXd& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

}  // namespace

std::string_view manoeuvre_words(ManoeuvreKind kind) {
  switch (kind) {
    case ManoeuvreKind::standstill: return "standing still";
    case ManoeuvreKind::cruising: return "cruising straight";
    case ManoeuvreKind::accelerating: return "accelerating straight";
    case ManoeuvreKind::turning: return "turning";
    case ManoeuvreKind::spinning: return "spinning on the spot";
  }
  return "";
}

ManoeuvreKind kind_of(const ReferenceMotion& motion, std::size_t first, std::size_t last) {
  check::that(first + 1 < last && last <= motion.instants(), "stretch", "two instants of the motion, or more");
  const auto from = static_cast<Eigen::Index>(first), count = static_cast<Eigen::Index>(last - first);
  const Eigen::MatrixXd w = motion.joint_speed.middleCols(from, count);
  const double speed = rms(w);
  if (!(speed > kStill * motion.joint_speed.cwiseAbs().maxCoeff())) {
    return ManoeuvreKind::standstill;
  }
  if (w.rows() == 2) {
    const double sum = rms(w.row(0) + w.row(1)), difference = rms(w.row(0) - w.row(1));
    if (sum < kStraight * difference) {
      return ManoeuvreKind::spinning;
    }
    if (difference >= kStraight * sum) {
      return ManoeuvreKind::turning;
    }
  }
  // Change over fifths of the stretch: single differences would show the encoder.
  const Eigen::Index gap = std::max<Eigen::Index>(1, count / 5);
  const Eigen::MatrixXd change = w.rightCols(count - gap) - w.leftCols(count - gap);
  return rms(change) * static_cast<double>(count) / static_cast<double>(gap) > kAccelerating * speed
             ? ManoeuvreKind::accelerating
             : ManoeuvreKind::cruising;
}

namespace {

// The instants at which faults set in: settled ones, evenly in time, that leave room for a window.
std::vector<std::size_t> choose_onsets(const ReferenceMotion& motion, const MarginOptions& options) {
  std::vector<std::size_t> onsets;
  const auto settled = static_cast<double>(std::count(motion.settled.begin(), motion.settled.end(), true));
  if (settled == 0.0) {
    return onsets;
  }
  const double step =
      std::max(options.onset_step, settled * core::median_step(motion.t) / static_cast<double>(options.most_onsets));
  double next = -kInfinity;
  for (std::size_t k = 0; k < motion.instants(); ++k) {
    const bool begins = std::binary_search(motion.segment_starts.begin(), motion.segment_starts.end(), k);
    next = begins ? -kInfinity : next;
    const auto after = std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), k);
    const std::size_t last = (after == motion.segment_starts.end() ? motion.instants() : *after) - 1;
    const bool room = k + 2 <= last && motion.t[last] - motion.instant[k] > options.windows.front();
    if (motion.settled[k] && room && motion.t[k] >= next) {
      onsets.push_back(k);
      next = motion.t[k] + step;
    }
  }
  return onsets;
}

// What the robot does when a fault sets in at each of `onsets`: the same for every fault.
std::vector<ManoeuvreKind> kinds_of(const ReferenceMotion& motion, const std::vector<std::size_t>& onsets,
                                    const MarginOptions& options) {
  const double length = std::min(options.kind_window, options.windows.back());
  std::vector<ManoeuvreKind> kinds;
  for (const std::size_t onset : onsets) {
    const auto after = std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), onset);
    const std::size_t end = after == motion.segment_starts.end() ? motion.instants() : *after;
    std::size_t last = onset + 1;
    while (last + 1 < end && motion.t[last + 1] - motion.instant[onset] <= length) {
      ++last;
    }
    kinds.push_back(kind_of(motion, onset, last + 1));
  }
  return kinds;
}

// The smallest certain size of one channel since the onset, under a rule "k of the last n".
class ChannelBest {
 public:
  ChannelBest(Persistence persistence, double largest, bool whole)
      : persistence_(persistence), lasting_(persistence), largest_(largest), whole_(whole) {}

  [[nodiscard]] double best() const { return best_; }

  void add(FaultMargin& margin, const FaultRow& row, double side, std::size_t channel) {
    if (whole_ && best_ < kInfinity) {
      return;
    }
    if (persistence_.n == 1) {
      // Only a row that shows a smaller size for certain is worth a search.
      const double limit = best_ < kInfinity ? best_ * (1.0 - 1e-9) : largest_;
      best_ = smallest(margin, row, limit, side, channel).value_or(best_);
      return;
    }
    best_ = std::min(best_, lasting_.add(smallest(margin, row, largest_, side, channel).value_or(kInfinity)));
  }

 private:
  [[nodiscard]] std::optional<double> smallest(FaultMargin& margin, const FaultRow& row, double limit, double side,
                                               std::size_t channel) const {
    if (!whole_) {
      return margin.smallest_certain(row, limit, side, channel);
    }
    return margin.certain(row, largest_, side, channel) ? std::optional(largest_) : std::nullopt;
  }

  Persistence persistence_;
  Lasting lasting_;
  double largest_;
  bool whole_;
  double best_ = kInfinity;
};

// One side of a fault from one onset on.
class SideWatch {
 public:
  SideWatch(const FaultMargins& margins, std::size_t outputs, const MarginOptions& options)
      : margins_(margins),
        options_(options),
        largest_(std::abs(margins.fault.kappa(margins.side * margins.largest()))),
        channels_(outputs, ChannelBest(options.persistence, largest_, margins.fault.whole)),
        hidden_(largest_),
        window_hidden_(largest_) {
    result_.by_channel.resize(outputs);
  }

  // Windows that end before `since` s after the onset; whether others are open.
  bool close_windows(double since) {
    while (open() && since > options_.windows[result_.certain.size()]) {
      double best = kInfinity;
      for (std::size_t i = 0; i < channels_.size(); ++i) {
        result_.by_channel[i].push_back(size_of(channels_[i].best()));
        best = std::min(best, result_.by_channel[i].back());
      }
      result_.certain.push_back(best);
      window_hidden_ = hidden_;
    }
    return open();
  }

  void add(FaultMargin& margin, const FaultRow& row, std::size_t channel) {
    channels_[channel].add(margin, row, margins_.side, channel);
    if (!margins_.fault.whole) {
      hidden_ = margin.largest_hidden(row, hidden_, margins_.side, options_.noise_share, channel);
    } else if (hidden_ > 0.0 && margin.possible(row, largest_, margins_.side, options_.noise_share, channel)) {
      hidden_ = 0.0;
    }
  }

  // Of rows that are not known exactly nothing is certain and nothing is hidden.
  void add_inexact() { hidden_ = 0.0; }

  [[nodiscard]] OnsetMargin result() {
    result_.hidden = size_of(window_hidden_);
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool open() const { return result_.certain.size() < options_.windows.size(); }
  [[nodiscard]] double size_of(double kappa) const {
    return kappa < kInfinity ? std::abs(margins_.fault.magnitude(margins_.side * kappa)) : kInfinity;
  }

  const FaultMargins& margins_;
  const MarginOptions& options_;
  double largest_;
  std::vector<ChannelBest> channels_;
  double hidden_, window_hidden_;
  OnsetMargin result_;
};

// Of the sides of one fault, all of which have the same rows; `solvers` has one for each.
void margins_from(const ReferenceMotion& motion, std::span<FaultMargins> sides, std::size_t onset, std::size_t instant,
                  FaultRows& rows, std::vector<FaultMargin>& solvers, const MarginOptions& options) {
  const std::size_t n = rows.outputs();
  std::vector<SideWatch> watches;
  for (const FaultMargins& side : sides) {
    watches.emplace_back(side, n, options);
  }
  const double start = motion.instant[instant];
  const bool exact = rows.exact();
  rows.begin(instant);
  for (bool open = true; open && rows.next();) {
    const double since = motion.t[rows.instant()] - start;
    for (SideWatch& watch : watches) {
      open = watch.close_windows(since);
    }
    for (std::size_t i = 0; open && i < n; ++i) {
      const FaultRow row = rows.row(i);
      for (std::size_t s = 0; s < sides.size(); ++s) {
        if (exact) {
          watches[s].add(solvers[s], row, i);
        } else {
          watches[s].add_inexact();
        }
      }
    }
  }
  for (std::size_t s = 0; s < sides.size(); ++s) {
    OnsetMargin& result = sides[s].onsets[onset];
    result = watches[s].result();
    result.instant = instant;
    result.t = start;
  }
}

}  // namespace

MarginSummary summarise(const FaultMargins& margins, std::size_t window, std::optional<ManoeuvreKind> kind,
                        std::optional<std::size_t> channel) {
  std::vector<double> sizes;
  for (const OnsetMargin& onset : margins.onsets) {
    if (onset.certain.size() > window && (!kind || onset.kind == *kind)) {
      sizes.push_back(channel ? onset.by_channel.at(*channel)[window] : onset.certain[window]);
    }
  }
  MarginSummary summary;
  summary.onsets = sizes.size();
  summary.best = summary.most = summary.median = summary.worst = kInfinity;
  if (!sizes.empty()) {
    std::sort(sizes.begin(), sizes.end());
    summary.certain =
        static_cast<std::size_t>(std::count_if(sizes.begin(), sizes.end(), [](double x) { return x < kInfinity; }));
    summary.best = sizes.front();
    summary.most = summary.certain > 0 ? sizes[summary.certain - 1] : kInfinity;
    summary.median = sizes[sizes.size() / 2];
    summary.worst = sizes.back();
  }
  return summary;
}

std::vector<FaultMargins> margins_along(const ReferenceMotion& motion, const std::vector<FaultType>& faults,
                                        const ThresholdRule& rule, const FaultRowsFactory& rows,
                                        const MarginOptions& options) {
  check::that(!options.windows.empty() && options.windows.front() > 0.0 &&
                  std::is_sorted(options.windows.begin(), options.windows.end()),
              "windows", "positive lengths in ascending order");
  check::positive(options.onset_step, "onset step");
  check::that(options.noise_share >= 0.0 && options.noise_share <= 1.0, "noise share", "a number from 0 to 1");
  const std::vector<std::size_t> onsets = choose_onsets(motion, options);
  check::that(!onsets.empty(), "drive", "a stretch in which the filter has settled and that is longer than a window");
  const std::vector<ManoeuvreKind> kinds = kinds_of(motion, onsets, options);
  std::vector<FaultMargins> all;
  std::vector<std::size_t> first;  // of each fault, and the end
  for (const FaultType& fault : faults) {
    first.push_back(all.size());
    for (const double side : {1.0, -1.0}) {
      if ((side > 0.0 ? fault.range.upper : -fault.range.lower) > 0.0) {
        all.push_back({fault, side, std::vector<OnsetMargin>(onsets.size())});
      }
    }
  }
  first.push_back(all.size());
  core::for_all(
      faults.size(), options.threads,
      [&](std::size_t f) {
        const std::span<FaultMargins> sides(all.begin() + static_cast<std::ptrdiff_t>(first[f]),
                                            first[f + 1] - first[f]);
        if (sides.empty()) {
          return;
        }
        const std::unique_ptr<FaultRows> source = rows(faults[f]);
        std::vector<FaultMargin> solvers(sides.size(), FaultMargin(rule));
        for (std::size_t k = 0; k < onsets.size(); ++k) {
          margins_from(motion, sides, k, onsets[k], *source, solvers, options);
          for (FaultMargins& side : sides) {
            side.onsets[k].kind = kinds[k];
          }
        }
      },
      [&](std::size_t begun) {
        if (options.progress) {
          options.progress("margins of faults", static_cast<double>(begun) / static_cast<double>(faults.size()));
        }
      });
  return all;
}

namespace {

// dY of a settled row.
core::RowMatrix settled_errors(const Model& model, const FilterDesign& design, const filter::SignalErrors& errors,
                               const Eigen::VectorXd& v) {
  core::RowMatrix dY =
      core::RowMatrix::Zero(static_cast<Eigen::Index>(model.n()), static_cast<Eigen::Index>(model.p()));
  if (errors.acceleration.size() == 0) {
    return dY;
  }
  const Eigen::VectorXd joints = core::pseudo_inverse(model.motion) * v;
  const std::vector<double> speed(v.begin(), v.end()), joint_speed(joints.begin(), joints.end()),
      speed_error(errors.speed_sample.begin(), errors.speed_sample.end()),
      joint_error(joint_speed.size(), errors.joint_sample);
  for (const Term& term : model.terms) {
    const auto c = static_cast<Eigen::Index>(term.coordinate);
    double error = 0.0;
    switch (term.kind) {
      case Term::Kind::acceleration: error = errors.acceleration[c]; break;
      case Term::Kind::speed: error = errors.speed[c]; break;
      case Term::Kind::function:
        error = design.static_gain() *
                term.function({speed, speed_error, joint_speed, joint_error, 0.0, errors.heading}).error;
        break;
    }
    dY(static_cast<Eigen::Index>(term.output), static_cast<Eigen::Index>(term.parameter)) +=
        std::abs(term.scale) * error;
  }
  return dY;
}

}  // namespace

OperatingMap operating_map(const FaultType& fault, double side, const Model& model, const FilterDesign& design,
                           const filter::SignalErrors& errors, const ThresholdRule& rule, OperatingPlane plane) {
  check::that(!plane.x.empty() && !plane.y.empty(), "operating plane", "values on both axes");
  const auto c = static_cast<Eigen::Index>(model.coordinates.size());
  const double largest = side > 0.0 ? fault.range.upper : -fault.range.lower;
  const double limit = std::abs(fault.kappa(side * largest));
  const std::size_t p = model.p();
  FaultMargin margin(rule);
  OperatingMap map{std::move(plane), {}};
  map.smallest.setConstant(static_cast<Eigen::Index>(map.plane.x.size()), static_cast<Eigen::Index>(map.plane.y.size()),
                           std::numeric_limits<double>::infinity());
  for (Eigen::Index a = 0; a < map.smallest.rows(); ++a) {
    for (Eigen::Index b = 0; b < map.smallest.cols(); ++b) {
      Eigen::VectorXd point = Eigen::VectorXd::Zero(c);
      point[0] = map.plane.x[static_cast<std::size_t>(a)];
      if (c > 1) {
        point[1] = map.plane.y[static_cast<std::size_t>(b)];
      }
      const Eigen::VectorXd rest = Eigen::VectorXd::Zero(c);
      const Eigen::VectorXd v = !map.plane.accelerations ? point : map.plane.at.size() == c ? map.plane.at : rest;
      const SettledRows rows = settled_rows(fault, model, design, v, map.plane.accelerations ? point : rest);
      const core::RowMatrix dY = settled_errors(model, design, errors, v);
      for (std::size_t i = 0; i < model.n(); ++i) {
        const auto r = static_cast<Eigen::Index>(i);
        const FaultRow row{{rows.Y.row(r).data(), p},
                           {rows.signature.g1.row(r).data(), p},
                           {rows.signature.g2.row(r).data(), p},
                           {rows.signature.s.row(r).data(), p},
                           {dY.row(r).data(), p},
                           rows.signature.c[r],
                           errors.output.size() > 0 ? errors.output[r] : 0.0};
        double& best = map.smallest(a, b);
        if (fault.whole) {
          best = margin.certain(row, limit, side, i) ? largest : best;
        } else if (const auto found = margin.smallest_certain(row, limit, side, i)) {
          best = std::min(best, std::abs(fault.magnitude(side * *found)));
        }
      }
    }
  }
  return map;
}

}  // namespace wheelwright::detector
