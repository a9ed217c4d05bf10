// SPDX-License-Identifier: Apache-2.0
#include "detector/multiscale/pose_margins.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "detector/faults/odometry_faults.hpp"
#include "detector/faults/smallest_certain.hpp"
#include "detector/multiscale/sum_kernel.hpp"

namespace wheelwright::detector {
namespace {

constexpr double kSameTime = 1e-9;  // s

// One fault in the sums of a drive.
class PoseResponse {
 public:
  PoseResponse(const FaultType& fault, const KinematicModel& model, const Model& robot, const PoseSumDrive& drive)
      : fault_(fault),
        model_(model),
        drive_(drive),
        signature_(odometry_signature(fault, robot)),
        p_(static_cast<Eigen::Index>(model.measurement.parameters().size())),
        gains_(model.measurement.position ? 2 : 0),
        s_(kParameters + (signature_.rolled.isZero(0.0) ? 0 : p_)),
        stationary_(fault.profile.kind == FaultProfile::Kind::step),
        signals_(Eigen::ArrayXXd::Zero(static_cast<Eigen::Index>(drive.weights.size()),
                                       s_ + (signature_.shown.isZero(0.0) ? 0 : p_))) {}

  // Visits every look up to `within` s after each onset: visit(onset, look, what κ moves it by, row).
  template <typename Visit>
  void walk(std::span<const double> onsets, double within, const Visit& visit) {
    std::vector<Active> active;
    std::vector<KernelSums> always(drive_.scales.size(), none());  // stationary: of the segment, as if from its begin
    std::size_t next_onset = 0, next_look = 0;
    for (std::size_t k = 0; k < drive_.steps.size(); ++k) {
      const PoseSumDetector::Step& step = drive_.steps[k];
      if (std::ranges::binary_search(drive_.segment_starts, k)) {
        active.clear();
        std::ranges::for_each(always, &KernelSums::reset);
      }
      const double now = step.begin + step.h;
      std::erase_if(active, [&](const Active& each) { return now - onsets[each.which] > within; });
      const std::size_t before = active.size();
      for (; next_onset < onsets.size() && onsets[next_onset] < now - kSameTime; ++next_onset) {
        if (onsets[next_onset] >= step.begin - kSameTime) {
          active.push_back({next_onset,
                            step.begin,
                            now,
                            {},
                            stationary_ ? always : std::vector(always.size(), none()),
                            Eigen::ArrayXd::Zero(signals_.rows())});
        }
      }
      if (stationary_) {
        sign(k, 1.0, 1.0);
        for (std::size_t j = before; j < active.size(); ++j) {
          active[j].cut = signals_.col(kCut);
        }
        add(step.h, always);
        for (std::size_t j = before; j < active.size(); ++j) {
          if (Active& each = active[j]; onsets[each.which] > step.begin + kSameTime) {
            each.begun = now;
            each.sums = always;
            each.cut += signals_.col(kMoved).abs();
          }
        }
      } else {
        for (Active& each : active) {
          take(k, step.begin - onsets[each.which], each);
        }
      }
      for (; next_look < drive_.looks.size() && drive_.looks[next_look].step == k; ++next_look) {
        for (const Active& each : active) {
          if (const At at{each, next_look, stationary_ ? &always : nullptr};
              speaks_of(drive_.looks[next_look].weight)) {
            visit(each.which, next_look, now - onsets[each.which], value(at, kMoved), [&] { return row(at); });
          }
        }
      }
    }
  }

 private:
  // A fault that has set in: sums of its own, or what the shared ones held when it did.
  struct Active {
    std::size_t which = 0;
    double begun = 0.0, first_end = 0.0;  // s: of the first step that is in the sums, and of the one it set in
    std::array<double, 2> angle{};        // of the joints since the onset
    std::vector<KernelSums> sums;
    Eigen::ArrayXd cut;   // weights: in doubt of the step in which it set in
    bool sets_in = true;  // in the next step
  };
  // A look after an onset.
  struct At {
    const Active& of;
    std::size_t look = 0;
    const std::vector<KernelSums>* always = nullptr;
  };
  // Columns of signals_: what κ moves the sum by at the estimate, what is in doubt, what more where the share jumps, c,
  // and g1 of the parameters where there is any; s_ is the first of s.
  static constexpr Eigen::Index kMoved = 0, kDoubt = 1, kCut = 2, kOffset = 3, kParameters = 4;

  [[nodiscard]] KernelSums none() const { return {signals_.rows(), signals_.cols()}; }

  // Where encoders show other ways, weights made of these are others.
  [[nodiscard]] bool speaks_of(std::size_t weight) const {
    using Shape = PoseWeight::Shape;
    const Shape shape = drive_.weights[weight].shape;
    return signature_.shown.isZero(0.0) || (shape != Shape::radius && shape != Shape::yaw_gain);
  }

  [[nodiscard]] double share_at(double since, const Active& each, const PoseSumDetector::Step& step) const {
    const std::size_t joint = fault_.profile.joint;
    return fault_.profile.at(since, each.angle[joint], step.moved[joint] / step.h);
  }

  void take(std::size_t k, double since, Active& each) {
    const PoseSumDetector::Step& step = drive_.steps[k];
    const bool first = std::exchange(each.sets_in, false);
    const double begin = share_at(std::max(since, 0.0), each, step);
    for (std::size_t w = 0; w < 2; ++w) {
      each.angle[w] += step.moved[w];
    }
    const double end = share_at(std::max(since, 0.0) + step.h, each, step);
    sign(k, 0.5 * (begin + end), std::abs(end - begin) + (first ? begin : 0.0));
    signals_.col(kDoubt) += signals_.col(kCut);
    if (since < -kSameTime) {  // in the midst of the step: anything between nothing and all
      signals_.col(kDoubt) += signals_.col(kMoved).abs();
      signals_.col(kMoved).setZero();
      signals_.rightCols(signals_.cols() - kOffset).setZero();
    }
    add(step.h, each.sums);
  }

  void add(double h, std::vector<KernelSums>& sums) const {
    for (std::size_t j = 0; j < sums.size(); ++j) {
      const double x = h / drive_.scales[j];
      sums[j].advance(x, std::exp(-x));
      sums[j].add(signals_);
    }
  }

  // Signals of a step in which the fault's share is s on average, and jumps by `jump` (kCut is of that).
  void sign(std::size_t k, double s, double jump) {
    const PoseSumDetector::Step& step = drive_.steps[k];
    const Eigen::Vector2d way(step.moved[0], step.moved[1]);
    const Eigen::Vector2d rolled = s * signature_.rolled * way, shown = s * signature_.shown * way;
    const double read = signature_.read_share() * jump * model_.errors.motion;
    const double turning = model_.at_risk->errors.heading.bound;
    for (std::size_t w = 0; w < drive_.weights.size(); ++w) {
      const auto row = static_cast<Eigen::Index>(w);
      const double gx = drive_.g(2 * row, static_cast<Eigen::Index>(k)),
                   gy = drive_.g(2 * row + 1, static_cast<Eigen::Index>(k));
      signals_.row(row).setZero();
      const bool of_position = drive_.weights[w].of_position();
      const double along = gx * step.mean[0] + gy * step.mean[1], across = gy * step.mean[0] - gx * step.mean[1];
      const double size = std::hypot(gx, gy);
      for (Eigen::Index j = 0; j < 2; ++j) {
        const auto wheel = static_cast<std::size_t>(j);
        const double factor = of_position ? 0.5 * along : wheel == 0 ? gx : -gx;
        const Eigen::Index parameter = of_position ? j : gains_ + j;
        signals_(row, kMoved) += factor * (rolled[j] - shown[j]) * model_.estimate[parameter];
        if (s_ > kParameters) {
          signals_(row, kParameters + parameter) = factor * rolled[j];
        }
        if (signals_.cols() > s_) {
          signals_(row, s_ + parameter) = factor * shown[j];
        }
        signals_(row, kCut) += read * std::abs(factor) * (of_position ? drive_.radius : drive_.yaw_gain)[wheel];
        if (of_position) {  // headings turn what was shown, unforeseen
          signals_(row, kDoubt) += 0.5 * turning * size * drive_.radius[wheel] * std::abs(shown[j]);
        }
      }
      signals_(row, kOffset) = of_position ? s * step.h * (signature_.along * along + fault_.lateral * across)
                                           : s * step.h * signature_.turning * gx;
      signals_(row, kMoved) += signals_(row, kOffset);
    }
  }

  [[nodiscard]] double value(const At& at, Eigen::Index column) const {
    const PoseSumDrive::Look& look = drive_.looks[at.look];
    const auto weight = static_cast<Eigen::Index>(look.weight);
    const KernelSums& own = at.of.sums[look.scale];
    if (at.always == nullptr) {
      return own.value(weight, column, SumKernel::kShape);
    }
    const double x = (drive_.end(look.step) - at.of.begun) / drive_.scales[look.scale];
    return (*at.always)[look.scale].since(weight, column, own, x, std::exp(-x));
  }

  [[nodiscard]] SumRow row(const At& at) const {
    const PoseSumDrive::Look& look = drive_.looks[at.look];
    SumRow row;
    row.y = drive_.y.row(static_cast<Eigen::Index>(at.look));
    row.g1 = row.g2 = row.s = row.range = row.none = Eigen::VectorXd::Zero(p_);
    const auto fill = [&](Eigen::Index first, Eigen::Index end, Eigen::VectorXd& to) {
      for (Eigen::Index j = 0; first + j < end; ++j) {
        to[j] = value(at, first + j);
      }
    };
    fill(kParameters, s_, row.g1);
    fill(s_, signals_.cols(), row.s);
    row.c = value(at, kOffset);
    row.dy = look.radius;
    // The radius holds what the encoders' errors do in the sum, by parts; K and S have a share of them.
    const double x = (drive_.end(look.step) - at.of.first_end) / drive_.scales[look.scale];
    row.doubt = std::max(0.0, value(at, kDoubt)) + signature_.read_share() * look.radius +
                SumKernel::at(SumKernel::kShape, x, std::exp(-x)) * at.of.cut[static_cast<Eigen::Index>(look.weight)];
    return row;
  }

  const FaultType& fault_;
  const KinematicModel& model_;
  const PoseSumDrive& drive_;
  OdometrySignature signature_;
  Eigen::Index p_, gains_, s_;
  bool stationary_;          // there in full from its onset on
  Eigen::ArrayXXd signals_;  // weights × columns, of the newest step
};

}  // namespace

PoseSumDrive read_pose_drive(LogSource& log, const KinematicModel& model, double false_alarms, double most) {
  const PoseSumOptions options{.false_alarms = false_alarms};
  PoseSumDetector detector(model, options);
  const ThresholdRule rule(Polytope(model.at_risk->facets, model.at_risk->box), model.estimate);
  PoseSumDrive drive;
  drive.weights = detector.weights();
  drive.scales = detector.scales();
  drive.radius = detector.largest_radii();
  drive.yaw_gain = detector.largest_yaw_gains();
  const double share = false_alarms / static_cast<double>(drive.weights.size() * drive.scales.size());
  drive.miss = model.at_risk->risk + share * drive.scales.back() / options.checks;
  std::vector<double> g, rows;
  std::vector<double> direction(model.measurement.parameters().size());
  double begun = core::kInfinity;
  std::size_t seen = 0;
  const auto wanted = [&](double t) {
    begun = std::min(begun, t);
    return t - begun <= most;
  };
  walk_pose_samples(log, detector, wanted, [&](bool) {
    if (detector.steps() == seen) {
      return;
    }
    if (detector.newest().number == 1) {
      drive.segment_starts.push_back(drive.steps.size());
    }
    seen = detector.steps();
    drive.steps.push_back(detector.newest());
    for (std::size_t w = 0; w < drive.weights.size(); ++w) {
      g.insert(g.end(), detector.step_weight(w).begin(), detector.step_weight(w).end());
    }
    for (const SumState& state : detector.looks()) {
      const Eigen::VectorXd y = detector.regressor(state);
      std::ranges::copy(y, direction.begin());
      drive.looks.push_back({drive.steps.size() - 1, state.weight, state.scale, state.radius,
                             rule.prediction(direction, state.weight).width()});
      rows.insert(rows.end(), y.begin(), y.end());
    }
  });
  drive.g = Eigen::Map<const Eigen::MatrixXd>(g.data(), 2 * static_cast<Eigen::Index>(drive.weights.size()),
                                              static_cast<Eigen::Index>(drive.steps.size()));
  drive.y = Eigen::Map<const core::RowMatrix>(rows.data(), static_cast<Eigen::Index>(drive.looks.size()),
                                              static_cast<Eigen::Index>(direction.size()));
  return drive;
}

std::vector<FaultMargins> pose_margins_at_risk(const PoseSumDrive& drive, const KinematicModel& model,
                                               const Model& robot, std::span<const FaultType> faults,
                                               std::span<const double> onsets, const SumMarginOptions& options) {
  std::vector<FaultMargins> all = sides_of(faults, onsets.size());
  for (FaultMargins& margins : all) {
    for (std::size_t k = 0; k < onsets.size(); ++k) {
      margins.onsets[k].t = onsets[k];
    }
  }
  // Until when the segment of each onset goes.
  std::vector<std::size_t> fit(onsets.size(), 0);
  for (std::size_t k = 0; k < onsets.size(); ++k) {
    const auto step = std::ranges::lower_bound(drive.steps, onsets[k] - kSameTime, {}, &PoseSumDetector::Step::begin);
    if (step != drive.steps.end()) {
      const auto at = static_cast<std::size_t>(step - drive.steps.begin());
      const auto next = std::ranges::upper_bound(drive.segment_starts, at);
      const PoseSumDetector::Step& last =
          next == drive.segment_starts.end() ? drive.steps.back() : drive.steps[*next - 1];
      fit[k] = windows_within(options.windows, last.begin + last.h - onsets[k]);
    }
  }
  solve_smallest_certain(
      all, faults, ThresholdRule(Polytope(model.at_risk->facets, model.at_risk->box), model.estimate), options,
      "margins of the pose at the stated risk", fit, [&](std::size_t f, SmallestCertain& smallest) {
        PoseResponse(faults[f], model, robot, drive)
            .walk(onsets, options.windows.back(),
                  [&](std::size_t onset, std::size_t look, double since, double moved, const auto& row) {
                    const PoseSumDrive::Look& at = drive.looks[look];
                    smallest.offer(
                        onset, {.since = since, .once = moved, .gap = at.width + 2.0 * at.radius, .channel = at.weight},
                        row);
                  });
      });
  return all;
}

}  // namespace wheelwright::detector
