// SPDX-License-Identifier: Apache-2.0
#include "detector/multiscale/sum_isolation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "bounds/polytope.hpp"
#include "core/for_all.hpp"
#include "core/limits.hpp"
#include "detector/faults/onset_rows.hpp"
#include "detector/learnt_model.hpp"
#include "detector/multiscale/sum_response.hpp"
#include "detector/threshold.hpp"

namespace wheelwright::detector {
namespace {

constexpr int kCuts = 14;  // of an interval of sizes

// What a look says of one onset, over the set: value − yθ, (g1 θ + c) per κ, g2 θ per κ².
struct LookAt {
  Interval left{}, once{}, twice{};
  double radius = 0.0, doubt = 0.0;
};

Interval hull(const Interval& a, const Interval& b) { return {std::min(a.lower, b.lower), std::max(a.upper, b.upper)}; }

Interval product(const Interval& a, const Interval& b) {
  const double corners[4] = {a.lower * b.lower, a.lower * b.upper, a.upper * b.lower, a.upper * b.upper};
  return {*std::min_element(corners, corners + 4), *std::max_element(corners, corners + 4)};
}

// Between two onsets: as far outside both as they are apart.
Interval between(const Interval& a, const Interval& b) {
  const double apart = std::max(std::abs(a.lower - b.lower), std::abs(a.upper - b.upper));
  const Interval both = hull(a, b);
  return {both.lower - apart, both.upper + apart};
}

LookAt between(const LookAt& a, const LookAt& b) {
  return {between(a.left, b.left), between(a.once, b.once), between(a.twice, b.twice), std::max(a.radius, b.radius),
          std::max(a.doubt, b.doubt)};
}

// True if no size of the interval explains the look.
bool excludes(const LookAt& look, const Interval& kappa) {
  const double size = core::magnitude(kappa);
  const Interval square{
      kappa.lower <= 0.0 && kappa.upper >= 0.0 ? 0.0 : std::min(kappa.lower * kappa.lower, kappa.upper * kappa.upper),
      size * size};
  const Interval once = product(kappa, look.once), twice = product(square, look.twice);
  const double room = look.radius + size * look.doubt;
  return once.lower + twice.lower > look.left.upper + room || once.upper + twice.upper < look.left.lower - room;
}

bool excludes(const std::vector<LookAt>& looks, const Interval& kappa) {
  return std::ranges::any_of(looks, [&](const LookAt& look) { return excludes(look, kappa); });
}

// The outermost size on one side that is left.
std::optional<double> end_of(const std::vector<LookAt>& looks, const Interval& kappa, double side, double resolution,
                             int depth) {
  if (excludes(looks, kappa)) {
    return std::nullopt;
  }
  const double size = core::magnitude(kappa);
  if (depth == 0 || kappa.width() <= resolution * size) {
    return side < 0.0 ? kappa.lower : kappa.upper;
  }
  const double middle = kappa.centre();
  const Interval low{kappa.lower, middle}, high{middle, kappa.upper};
  const auto outer = end_of(looks, side < 0.0 ? low : high, side, resolution, depth - 1);
  return outer ? outer : end_of(looks, side < 0.0 ? high : low, side, resolution, depth - 1);
}

// Looks between `from` and `to`, of each sum at most `most`.
std::vector<std::size_t> some_looks(const SumDrive& drive, std::size_t from, double to, std::size_t most) {
  std::vector<std::vector<std::size_t>> of(drive.weights.size() * drive.scales.size());
  for (std::size_t k = 0; k < drive.looks.size(); ++k) {
    const SumLook& look = drive.looks[k];
    if (look.instant > from && look.t <= to) {
      of[look.weight * drive.scales.size() + look.scale].push_back(k);
    }
  }
  std::vector<std::size_t> some;
  for (const std::vector<std::size_t>& all : of) {
    const std::size_t count = std::min(most, all.size());
    for (std::size_t k = 0; k < count; ++k) {
      some.push_back(all[(k + 1) * all.size() / count - 1]);
    }
  }
  std::ranges::sort(some);
  return some;
}

// The instants that are tried as onsets: those about the interval, in steps.
std::vector<std::size_t> onsets_in(const ReferenceMotion& motion, const Interval& onset, double step) {
  const auto first = std::ranges::lower_bound(motion.instant, onset.lower) - motion.instant.begin();
  const auto last = std::ranges::upper_bound(motion.instant, onset.upper) - motion.instant.begin();
  const auto from = static_cast<std::size_t>(std::max<std::ptrdiff_t>(first - 1, 0));
  const std::size_t to = std::min(static_cast<std::size_t>(last), motion.instants() - 2);
  std::vector<std::size_t> onsets;
  for (std::size_t k = from; k <= to; ++k) {
    if (onsets.empty() || k == to || motion.instant[k + 1] - motion.instant[onsets.back()] > step) {
      onsets.push_back(k);
    }
  }
  return onsets;
}

class Narrowing {
 public:
  Narrowing(FaultFinding& finding, const SumDrive& drive, const OnlineModel& model, const ReferenceMotion& motion,
            const SumIsolationOptions& options)
      : finding_(finding),
        drive_(drive),
        model_(model),
        motion_(motion),
        options_(options),
        rule_(Polytope(model.at_risk->facets, model.at_risk->box), model.estimate) {}

  void run(double alarm) {
    FaultType fault = finding_.fault;
    const bool encoder = fault.seen.size() > 0, held = fault.held_effort;
    if (encoder) {
      fault = as_motion_of_reading(fault);
    } else if (held) {
      // What it stands at is not known: an offset of any size in place of the effort.
      Eigen::Index column = 0;
      fault.effort.cwiseAbs().colwise().sum().maxCoeff(&column);
      fault.offset = fault.effort.col(column);
      fault.held_effort = false;
    }
    Interval kappa{fault.kappa(fault.range.lower), fault.kappa(fault.range.upper)};
    if (finding_.magnitude && !encoder) {
      kappa = {fault.kappa(finding_.magnitude->lower), fault.kappa(finding_.magnitude->upper)};
    } else if (finding_.magnitude) {
      const auto reduced = [](double size) { return size / (1.0 + size); };
      kappa = {reduced(finding_.fault.kappa(finding_.magnitude->lower)),
               reduced(finding_.fault.kappa(finding_.magnitude->upper))};
    } else if (fault.whole && !held) {
      kappa.lower = kappa.upper;
    } else if (held) {
      kappa = {-1e6, 1e6};
    }
    const std::vector<std::size_t> onsets = onsets_in(motion_, finding_.onset, options_.onset_step);
    if (onsets.size() < 2) {
      return;
    }
    const std::vector<std::size_t> looks =
        some_looks(drive_, onsets.back() + 1, alarm + options_.after, options_.looks);
    if (looks.empty()) {
      return;
    }
    read(fault, held, onsets, looks, alarm);
    std::optional<Interval> sizes, when;
    std::vector<LookAt> cell;
    for (std::size_t k = 0; k + 1 < onsets.size(); ++k) {
      cell.clear();
      for (std::size_t l = 0; l < looks.size(); ++l) {
        cell.push_back(between(table_[k * looks.size() + l], table_[(k + 1) * looks.size() + l]));
      }
      const auto lower = end_of(cell, kappa, -1.0, options_.resolution, kCuts);
      const auto upper = lower ? end_of(cell, {*lower, kappa.upper}, 1.0, options_.resolution, kCuts) : std::nullopt;
      if (!upper) {
        continue;
      }
      const Interval left{*lower, *upper}, time{motion_.instant[onsets[k]], motion_.instant[onsets[k + 1]]};
      sizes = sizes ? hull(*sizes, left) : left;
      when = when ? hull(*when, time) : time;
    }
    SumFinding found{!sizes, finding_.magnitude, finding_.onset};
    if (sizes) {
      found.onset = {std::max(found.onset.lower, when->lower), std::min(found.onset.upper, when->upper)};
    } else {
      found.magnitude.reset();
    }
    if (found.magnitude) {
      const auto size = [&](double x) { return finding_.fault.magnitude(encoder ? x / (1.0 - x) : x); };
      found.magnitude = Interval{std::max(found.magnitude->lower, size(sizes->lower)),
                                 std::min(found.magnitude->upper, size(sizes->upper))};
    }
    finding_.at_risk = found;
  }

 private:
  [[nodiscard]] Interval over_set(const Eigen::VectorXd& row, std::size_t channel) const {
    return rule_.prediction({row.data(), static_cast<std::size_t>(row.size())}, channel);
  }

  void read(const FaultType& fault, bool held, const std::vector<std::size_t>& onsets,
            const std::vector<std::size_t>& looks, double alarm) {
    table_.assign(onsets.size() * looks.size(), {});
    SumResponse response(fault, model_, motion_, drive_);
    const double within = alarm + options_.after - motion_.instant[onsets.front()] + 1.0;
    response.walk(onsets, within, [&](const SumResponse::At& at) {
      const auto found = std::ranges::lower_bound(looks, at.look);
      if (found == looks.end() || *found != at.look) {
        return;
      }
      const SumLook& look = drive_.looks[at.look];
      const SumRow row = at.row();
      LookAt& own = table_[at.onset * looks.size() + static_cast<std::size_t>(found - looks.begin())];
      const double torque = look.value + row.y.dot(model_.estimate);
      const Interval healthy = over_set(held ? Eigen::VectorXd(row.y + row.g1) : row.y, look.weight);
      own.left = {torque - healthy.upper, torque - healthy.lower};
      own.once = held ? Interval{0.0, 0.0} : over_set(row.g1, look.weight + 1);
      own.once = {own.once.lower + row.c, own.once.upper + row.c};
      own.twice = held ? Interval{0.0, 0.0} : over_set(row.g2, look.weight + 2);
      own.radius = row.dy;
      own.doubt = row.doubt;
      for (Eigen::Index q = 0; q < row.range.size(); ++q) {
        own.doubt += row.range[q] * core::magnitude(model_.at_risk->box.sides[static_cast<std::size_t>(q)]);
      }
      if (held) {  // the effort's own errors do not grow with what it stands at
        own.radius += own.doubt;
        own.doubt = 0.0;
      }
    });
  }

  FaultFinding& finding_;
  const SumDrive& drive_;
  const OnlineModel& model_;
  const ReferenceMotion& motion_;
  const SumIsolationOptions& options_;
  ThresholdRule rule_;
  std::vector<LookAt> table_;  // onsets × looks
};

}  // namespace

void narrow_by_sums(Isolation& isolation, const SumDrive& drive, const OnlineModel& model,
                    const ReferenceMotion& motion, double alarm, const SumIsolationOptions& options) {
  core::for_all(isolation.findings.size(), options.threads, [&](std::size_t k) {
    FaultFinding& finding = isolation.findings[k];
    if (finding.verdict == FaultFinding::Verdict::consistent && !finding.earlier &&
        OnsetRows::knows(finding.fault, model.model)) {
      Narrowing(finding, drive, model, motion, options).run(alarm);
    }
  });
}

}  // namespace wheelwright::detector
