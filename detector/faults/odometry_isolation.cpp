// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/odometry_isolation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "bounds/polytope.hpp"
#include "core/check.hpp"
#include "core/for_all.hpp"
#include "core/limits.hpp"
#include "detector/faults/isolation_search.hpp"
#include "detector/faults/onset_rows.hpp"
#include "model/filter/odometry_filter.hpp"

namespace wheelwright::detector {
namespace {

// Sums over steps, or bounds on them.
struct WaySums {
  std::array<Eigen::Vector2d, 2> rolled{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};  // E q/2 of each wheel
  Eigen::Vector2d turned = Eigen::Vector2d::Zero();                                         // q of each wheel
  Eigen::Vector2d slipped = Eigen::Vector2d::Zero();                                        // E a_1 h + E⊥ d h
  double slipped_turn = 0.0;                                                                // a_2 h

  void add(double by, const WaySums& other) {
    for (std::size_t w = 0; w < 2; ++w) {
      rolled[w] += by * other.rolled[w];
    }
    turned += by * other.turned;
    slipped += by * other.slipped;
    slipped_turn += by * other.slipped_turn;
  }
  [[nodiscard]] WaySums minus(const WaySums& other) const {
    WaySums out = *this;
    out.add(-1.0, other);
    return out;
  }
  // Bounds that hold in every frame.
  [[nodiscard]] WaySums size() const {
    WaySums out;
    for (std::size_t w = 0; w < 2; ++w) {
      out.rolled[w].setConstant(rolled[w].norm());
    }
    out.turned = turned.cwiseAbs();
    out.slipped.setConstant(slipped.norm());
    out.slipped_turn = std::abs(slipped_turn);
    return out;
  }
};

bool comes_slowly(const FaultType& fault) { return fault.profile.kind == FaultProfile::Kind::ramp; }

// True if the rows of the fault are known.
bool rows_are_known(const FaultType& fault) {
  if (fault.profile.kind != FaultProfile::Kind::step && !comes_slowly(fault)) {
    return false;
  }
  if (fault.seen.size() == 0) {
    return true;
  }
  return fault.motion.size() == 0 && fault.slip.size() == 0 && fault.lateral == 0.0 && !fault.whole &&
         !comes_slowly(fault) &&
         (fault.seen * fault.seen - fault.seen).cwiseAbs().maxCoeff() <= 1e-12 * fault.seen.cwiseAbs().maxCoeff();
}

class OdometryOnsetRows final : public HypothesisRows {
 public:
  OdometryOnsetRows(const FaultType& fault, const Model& model, const filter::OdometryMeasurement& measurement,
                    const filter::OdometryErrors& errors, const OdometryReference& reference, std::size_t first,
                    std::size_t end)
      : fault_(fault.seen.size() > 0 ? as_motion_of_reading(fault) : fault),
        encoder_(fault.seen.size() > 0),
        reference_(&reference),
        measurement_(&measurement),
        errors_(&errors),
        share_(odometry_signature(fault_, model).read_share()),
        first_(first),
        end_(end),
        n_(measurement.outputs().size()),
        p_(static_cast<Eigen::Index>(measurement.parameters().size())) {
    const OdometrySignature signature = odometry_signature(fault_, model);
    const ReferenceMotion& motion = reference.motion;
    WaySums sum, path;
    double steps = 0.0;
    sums_.push_back(sum);
    paths_.push_back(path);
    within_.push_back(steps);
    for (std::size_t k = first; k + 1 < end; ++k) {
      const auto a = static_cast<Eigen::Index>(k);
      const double h = motion.t[k + 1] - motion.t[k];
      const Eigen::Vector2d q = signature.rolled * (motion.joint_angle.col(a + 1) - motion.joint_angle.col(a));
      const std::array<double, 2> direction = filter::mean_direction(motion.heading[k], motion.heading[k + 1]);
      const Eigen::Vector2d e(direction[0], direction[1]), left(-e[1], e[0]);
      WaySums step;
      for (std::size_t w = 0; w < 2; ++w) {
        step.rolled[w] = 0.5 * q[static_cast<Eigen::Index>(w)] * e;
      }
      step.turned = q;
      step.slipped = h * (signature.along * e + fault_.lateral * left);
      step.slipped_turn = h * signature.turning;
      sum.add(1.0, step);
      path.add(1.0, step.size());
      // A heading that does not turn evenly within a step: |θ̈| <= 2cA.
      steps += h * std::hypot(signature.along, fault_.lateral) *
               (errors.heading + 0.25 * h * h * errors.yaw_gain * errors.acceleration);
      sums_.push_back(sum);
      paths_.push_back(path);
      within_.push_back(steps);
    }
  }

  void between(std::size_t a, std::size_t b) override {
    check::that(a >= first_ && a < b && b + 1 < end_, "onset", "instants of the motion");
    from_ = a > first_ ? a - 1 : a;
    s_ = b + 1;
    if (!comes_slowly(fault_)) {
      return;
    }
    const std::vector<double>& t = reference_->motion.t;
    uncertain_ = std::min(1.0, (t[s_] - t[from_]) / fault_.profile.rise);
    drifting_.assign(1, WaySums{});
    for (std::size_t k = s_; k + 1 < end_; ++k) {
      const double middle = 0.5 * (t[k] + t[k + 1]) - t[s_];
      drifting_.push_back(drifting_.back());
      drifting_.back().add(std::min(1.0, middle / fault_.profile.rise), sums_[k + 1 - first_].minus(sums_[k - first_]));
    }
  }

  [[nodiscard]] std::size_t start() const override { return s_; }
  [[nodiscard]] bool encoder() const override { return encoder_; }

  void row(std::size_t k, std::size_t i, OnsetRow& out) override {
    check::that(k > s_ && k < end_, "instant", "one after the onset");
    const ReferenceMotion& motion = reference_->motion;
    const std::size_t window = std::max(reference_->window[k], first_);
    const std::size_t known = std::max(window, s_), doubtful = std::max(window, std::min(from_, known));
    const WaySums full = since(sums_, known, k);
    const WaySums signature = comes_slowly(fault_) ? drifting_[k - s_].minus(drifting_[known - s_]) : full;
    WaySums doubt = since(paths_, doubtful, known);
    if (comes_slowly(fault_)) {
      doubt = since(paths_, doubtful, k);
      const WaySums part = doubt;
      doubt.add(uncertain_ - 1.0, part);
    }
    for (Eigen::RowVectorXd* part : {&out.e0, &out.g1, &out.g2, &out.e1, &out.e2}) {
      part->setZero(p_);
    }
    out.c = out.ec = 0.0;
    out.left = {};
    write(signature, doubt, motion.heading[reference_->window[k]], i, out);
    const auto at = static_cast<Eigen::Index>(k * n_ + i);
    out.e1.array() += share_ * motion.rows.dY.row(at).maxCoeff();
    if (errors_->estimated.size() > 0) {
      out.ec += share_ * motion.rows.dy[at];
    }
    if (measurement_->position && i < 2) {
      out.ec += within_[k - first_] - within_[doubtful - first_];
    }
  }

 private:
  [[nodiscard]] WaySums since(const std::vector<WaySums>& sums, std::size_t from, std::size_t to) const {
    return sums[to - first_].minus(sums[from - first_]);
  }

  // Entries of output `i`, as OdometryFaultRows has them.
  void write(const WaySums& sum, const WaySums& doubt, double heading, std::size_t i, OnsetRow& out) const {
    if (measurement_->position && i < 2) {
      const double c = std::cos(heading), s = std::sin(heading);
      const auto turned_back = [&](const Eigen::Vector2d& v) {
        return i == 0 ? c * v[0] + s * v[1] : c * v[1] - s * v[0];
      };
      for (std::size_t w = 0; w < 2; ++w) {
        const auto j = static_cast<Eigen::Index>(w);
        out.g1[j] = turned_back(sum.rolled[w]);
        out.e1[j] = doubt.rolled[w].maxCoeff();
      }
      out.c = turned_back(sum.slipped);
      out.ec = doubt.slipped.maxCoeff();
      return;
    }
    const Eigen::Index column = measurement_->position ? 2 : 0;
    for (Eigen::Index w = 0; w < 2; ++w) {
      out.g1[column + w] = (w == 0 ? 1.0 : -1.0) * sum.turned[w];
      out.e1[column + w] = doubt.turned[w];
    }
    out.c = sum.slipped_turn;
    out.ec = doubt.slipped_turn;
  }

  FaultType fault_;
  bool encoder_;
  const OdometryReference* reference_;
  const filter::OdometryMeasurement* measurement_;
  const filter::OdometryErrors* errors_;
  double share_;
  std::size_t first_, end_, from_ = 0, s_ = 0;
  std::size_t n_;
  Eigen::Index p_;
  double uncertain_ = 0.0;
  std::vector<WaySums> sums_, paths_;  // from first_ to each instant, of a fault that is there
  std::vector<double> within_;         // the same of what a slip's direction is in doubt by
  std::vector<WaySums> drifting_;      // from s_, of a drift from there on
};

// The finding on a fault without a trace: that of a healthy robot's rows.
void take_healthy(bool healthy, const IsolationWindow& window, const ReferenceMotion& motion, FaultFinding& finding) {
  finding.verdict = healthy ? FaultFinding::Verdict::consistent : FaultFinding::Verdict::excluded;
  if (healthy) {
    finding.onset = {motion.t[window.first], motion.t[window.outside]};
    finding.earlier = true;
    if (!finding.fault.whole) {
      finding.magnitude = finding.fault.range;
    }
  }
}

std::optional<Interval> overlap(const Interval& a, const Interval& b) {
  const Interval both{std::max(a.lower, b.lower), std::min(a.upper, b.upper)};
  return both.lower <= both.upper ? std::optional<Interval>(both) : std::nullopt;
}

// What both leave; nothing where that is nothing.
std::optional<FaultFinding> left_by_both(const FaultFinding& a, const FaultFinding& b, double slack) {
  FaultFinding out = a;
  const auto reach = [](const FaultFinding& f) {
    return Interval{f.earlier ? -core::kInfinity : f.onset.lower, f.onset.upper};
  };
  const Interval wide = reach(b);
  const auto onset = overlap(reach(a), {wide.lower - slack, wide.upper + slack});
  if (!onset) {
    return std::nullopt;
  }
  out.earlier = a.earlier && b.earlier;
  out.onset = {out.earlier ? std::min(a.onset.lower, onset->upper) : onset->lower, onset->upper};
  out.complete = a.complete && b.complete;
  if (a.magnitude && b.magnitude) {
    out.magnitude = overlap(*a.magnitude, *b.magnitude);
    if (!out.magnitude) {
      return std::nullopt;
    }
  }
  return out;
}

}  // namespace

bool shows_in_odometry(const FaultType& fault) {
  const auto any = [](const auto& part) { return part.size() > 0 && !part.isZero(0.0); };
  return any(fault.motion) || any(fault.slip) || any(fault.seen) || fault.lateral != 0.0;
}

Isolation isolate_by_odometry(const OdometryReference& reference, const Model& model,
                              const filter::OdometryMeasurement& measurement, const filter::OdometryErrors& errors,
                              double window, const Polytope& set, const std::vector<FaultType>& faults, double outside,
                              double alarm, const IsolationOptions& options) {
  Isolation isolation;
  isolation.findings.resize(faults.size());
  for (std::size_t k = 0; k < faults.size(); ++k) {
    isolation.findings[k].fault = faults[k];
  }
  const ReferenceMotion& motion = reference.motion;
  if (motion.instants() == 0) {
    return isolation;
  }
  // The last pose may be older than the alarm.
  // A window is as long as its last sample before that allows.
  const IsolationSetting setting(
      motion, set, options,
      isolation_window(motion, {1.1 * window + 2.0 * measurement.nominal_step, 0.5 * window},
                       std::min(outside, motion.t.back()), std::min(alarm, motion.t.back()), options));
  const IsolationWindow& w = setting.window;
  isolation.window = {motion.t[w.begin], motion.t[w.end - 1]};
  if (w.rows.empty() || w.end < w.begin + 4) {
    return isolation;
  }
  const auto look = [&](FaultFinding& finding) {
    OdometryOnsetRows rows(finding.fault, model, measurement, errors, reference, w.first, w.end);
    search(setting, rows, false, 0.0, finding);
  };
  const bool healthy = explained_without_fault(setting);
  core::for_all(faults.size(), options.threads, [&](std::size_t k) {
    FaultFinding& finding = isolation.findings[k];
    validate(finding.fault, model);
    if (!shows_in_odometry(finding.fault)) {
      take_healthy(healthy, w, motion, finding);
    } else if (rows_are_known(finding.fault)) {
      look(finding);
    }
  });
  return isolation;
}

Eigen::MatrixXd odometry_responses(const OdometryReference& reference, const Model& model,
                                   const filter::OdometryMeasurement& measurement, const filter::OdometryErrors& errors,
                                   const FaultType& fault, const Eigen::VectorXd& theta,
                                   const std::vector<std::size_t>& instants, const std::vector<double>& times) {
  const ReferenceMotion& motion = reference.motion;
  const auto outputs = static_cast<Eigen::Index>(measurement.outputs().size());
  if (!rows_are_known(fault) || motion.instants() < 4) {
    return {};
  }
  OdometryOnsetRows rows(fault, model, measurement, errors, reference, 0, motion.instants());
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(instants.size()) * outputs,
                                              static_cast<Eigen::Index>(times.size()));
  for (std::size_t c = 0; c < times.size(); ++c) {
    const auto at = static_cast<std::size_t>(std::ranges::lower_bound(motion.t, times[c]) - motion.t.begin());
    const std::size_t start = std::max<std::size_t>(at, 2);
    if (start >= motion.instants()) {
      continue;
    }
    rows.between(start - 2, start - 1);
    OnsetRow row;
    for (std::size_t r = 0; r < instants.size(); ++r) {
      for (Eigen::Index i = 0; i < outputs && instants[r] > start; ++i) {
        rows.row(instants[r], static_cast<std::size_t>(i), row);
        out(static_cast<Eigen::Index>(r) * outputs + i, static_cast<Eigen::Index>(c)) = row.g1.dot(theta) + row.c;
      }
    }
  }
  return out;
}

void narrow_by(Isolation& isolation, const Isolation& other, double slack) {
  using Verdict = FaultFinding::Verdict;
  check::that(other.findings.size() == isolation.findings.size(), "other", "findings on the same faults");
  for (std::size_t k = 0; k < isolation.findings.size(); ++k) {
    FaultFinding& own = isolation.findings[k];
    const FaultFinding& its = other.findings[k];
    if (own.verdict == Verdict::excluded || its.verdict == Verdict::not_examined) {
      continue;
    }
    std::optional<FaultFinding> left;
    if (its.verdict == Verdict::consistent && own.verdict == Verdict::consistent) {
      left = left_by_both(own, its, slack);
    } else if (its.verdict == Verdict::consistent) {
      left = shows_in_odometry(own.fault) ? its : own;
    }
    if (left) {
      own = *left;
    } else {
      own.verdict = Verdict::excluded;
      own.magnitude.reset();
      own.at_risk.reset();
    }
  }
}

}  // namespace wheelwright::detector
