// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/kinematic_calibration.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include <ceres/ceres.h>
#include <Eigen/Dense>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/identify/block_sums.hpp>
#include <wheelwright/identify/noise_level.hpp>

namespace wheelwright {
namespace {

constexpr double kMadToSigma = 1.4826;
constexpr int kRescalings = 20;
constexpr std::size_t kFewestArcs = 8;

// Shared unknowns, all of order one: v = ρ r/2 (a_R ω_R + a_L ω_L), θ̇ = γ r/D (a_R ω_R − a_L ω_L), a = 1 ± ε; the
// pose's point is κ D ahead of the axle and its stamp is δ late.
enum Shared : int { kScale, kTurn, kAsymmetry, kOffset, kDelay, kShared };
using SharedVector = Eigen::Matrix<double, kShared, 1>;
using SharedMatrix = Eigen::Matrix<double, kShared, kShared>;

struct Pose {
  double t, x, y, theta;
};

struct Window {
  std::vector<double> t, right, left;
  std::vector<Pose> poses;
  std::array<double, 3> start{};  // θ, x, y at t.front()
};

double wrapped(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

// Where the robot is at the poses' stamps less δ, by the midpoint rule between wheel-speed samples (θ exactly):
// θ, x, y of each pose.
template <typename T>
std::vector<std::array<T, 3>> predict(const Window& w, const KinematicOptions& o, const T* shared, const T* start) {
  using std::cos;
  using std::sin;
  const T right = 1.0 + shared[kAsymmetry];
  const T left = 1.0 - shared[kAsymmetry];
  const T forward = 0.5 * o.wheel_radius * shared[kScale];
  const T turning = o.wheel_radius / o.track_width * shared[kTurn];
  const T ahead = o.track_width * shared[kOffset];
  const auto moved = [&](std::array<T, 3> at, std::size_t k, const T& step) {
    const T half = 0.5 * step / (w.t[k + 1] - w.t[k]);  // of the way to the next sample, at the middle of the step
    const T omega_r = w.right[k] + half * (w.right[k + 1] - w.right[k]);
    const T omega_l = w.left[k] + half * (w.left[k + 1] - w.left[k]);
    const T turn = step * turning * (right * omega_r - left * omega_l);
    const T way = step * forward * (right * omega_r + left * omega_l);
    const T heading = at[0] + 0.5 * turn;
    at[0] += turn;
    at[1] += way * cos(heading);
    at[2] += way * sin(heading);
    return at;
  };
  std::vector<std::array<T, 3>> poses;
  poses.reserve(w.poses.size());
  std::array<T, 3> at = {start[0], start[1], start[2]};
  std::size_t k = 0;
  for (const Pose& pose : w.poses) {
    const T end = pose.t - shared[kDelay];
    for (; k + 2 < w.t.size() && end >= w.t[k + 1]; ++k) {
      at = moved(at, k, T(w.t[k + 1] - w.t[k]));
    }
    poses.push_back(moved(at, k, end - w.t[k]));
    poses.back()[1] += ahead * cos(poses.back()[0]);
    poses.back()[2] += ahead * sin(poses.back()[0]);
  }
  return poses;
}

struct Spreads {
  double heading = 1.0;
  double position = 1.0;
};

// Residuals of a window over their spreads: θ, x, y of each pose, or θ alone. With a finite `huber` each is drawn in so
// that its square is Huber's loss (position: of the distance).
struct WindowError {
  const Window* window;
  const KinematicOptions* options;
  Spreads spreads;
  bool position;
  double huber;

  template <typename T>
  [[nodiscard]] T drawn_in(const T& squared) const {
    using std::sqrt;
    return squared > huber * huber ? T(sqrt((2.0 * huber * sqrt(squared) - huber * huber) / squared)) : T(1.0);
  }
  template <typename T>
  bool operator()(T const* const* parameters, T* residual) const {
    const auto poses = predict(*window, *options, parameters[0], parameters[1]);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Pose& measured = window->poses[k];
      const T turn = (poses[k][0] - measured.theta) / spreads.heading;
      *residual++ = turn * drawn_in(T(turn * turn));
      if (position) {
        const T dx = (poses[k][1] - measured.x) / spreads.position;
        const T dy = (poses[k][2] - measured.y) / spreads.position;
        const T factor = drawn_in(T(dx * dx + dy * dy));
        *residual++ = dx * factor;
        *residual++ = dy * factor;
      }
    }
    return true;
  }
};

using WindowCost = ceres::DynamicAutoDiffCostFunction<WindowError, kShared + 3>;

std::unique_ptr<WindowCost> window_cost(const WindowError& error) {
  auto cost = std::make_unique<WindowCost>(new WindowError(error));
  cost->AddParameterBlock(kShared);
  cost->AddParameterBlock(3);
  cost->SetNumResiduals(static_cast<int>(error.window->poses.size() * (error.position ? 3 : 1)));
  return cost;
}

void validate(const KinematicOptions& o) {
  check::positive(o.wheel_radius, "wheel_radius");
  check::positive(o.track_width, "track_width");
  check::non_negative(o.largest_delay, "largest_delay");
  check::positive(o.window, "window");
  check::that(o.largest_delay < 0.5 * o.window, "largest_delay", "less than half a window");
  check::positive(o.huber, "huber");
  check::that(o.fewest_poses >= 4, "fewest_poses", "at least 4");
}

std::vector<Window> cut(const LogTable& log, const KinematicOptions& o, bool position, KinematicCalibration& result) {
  const auto& right = log.column("omega_r");
  const auto& left = log.column("omega_l");
  const auto& theta = log.column("theta");
  static const std::vector<double> none;
  const auto& x = position ? log.column("x") : none;
  const auto& y = position ? log.column("y") : none;
  std::vector<std::size_t> starts = log.segment_starts;
  if (starts.empty() || starts.front() != 0) {
    starts.insert(starts.begin(), 0);
  }
  std::vector<Window> windows;
  for (std::size_t s = 0; s < starts.size(); ++s) {
    const std::size_t end = s + 1 < starts.size() ? starts[s + 1] : log.rows();
    for (std::size_t first = starts[s]; first + 1 < end;) {
      // The last row of a window is the first of the next one, as far as wheel speeds go.
      std::size_t last = first + 1;
      while (last + 1 < end && log.t[last + 1] - log.t[first] <= o.window) ++last;
      Window w;
      std::optional<std::size_t> before;
      for (std::size_t k = first; k <= last; ++k) {
        w.t.push_back(log.t[k]);
        w.right.push_back(right[k]);
        w.left.push_back(left[k]);
        if (k == last && last + 1 < end) {
          break;
        }
        const bool held =
            before && theta[k] == theta[*before] && (!position || (x[k] == x[*before] && y[k] == y[*before]));
        result.held_poses += held ? 1 : 0;
        if (held) {
          continue;
        }
        if (log.t[k] - log.t[first] >= o.largest_delay) {
          const double heading = w.poses.empty() ? theta[k] : w.poses.back().theta + wrapped(theta[k] - theta[*before]);
          w.poses.push_back({log.t[k], position ? x[k] : 0.0, position ? y[k] : 0.0, heading});
        }
        before = k;
      }
      if (w.poses.size() >= o.fewest_poses) {
        result.poses += w.poses.size();
        w.start = {w.poses.front().theta, w.poses.front().x, w.poses.front().y};
        windows.push_back(std::move(w));
      }
      first = last;
    }
  }
  return windows;
}

double robust_spread(std::vector<double> residuals) {
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  for (double& r : residuals) r = std::abs(r);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return kMadToSigma * *middle;
}

class Fit {
 public:
  Fit(std::vector<Window> windows, const KinematicOptions& options, bool position)
      : windows_(std::move(windows)), options_(&options), position_(position) {
    shared_ << 1.0, 1.0, 0.0, 0.0, 0.5 * options.largest_delay;
    free_ = {position && options.radius, true, options.asymmetry, position && options.axle_offset,
             options.largest_delay > 0.0};
  }

  bool solve() {
    ceres::Problem problem;
    auto* order = new ceres::ParameterBlockOrdering;
    for (Window& w : windows_) {
      order->AddElementToGroup(w.start.data(), 0);
      problem.AddResidualBlock(window_cost({&w, options_, spreads_, position_, options_->huber}).release(), nullptr,
                               shared_.data(), w.start.data());
    }
    order->AddElementToGroup(shared_.data(), 1);
    std::vector<int> constant;
    for (int j = 0; j < kShared; ++j) {
      const bool needs_position = j == kScale || j == kOffset;
      if (!free_[static_cast<std::size_t>(j)] || (needs_position && !position_)) constant.push_back(j);
    }
    if (!constant.empty()) {
      problem.SetManifold(shared_.data(), new ceres::SubsetManifold(kShared, constant));
    }
    if (free_[kDelay]) {
      problem.SetParameterLowerBound(shared_.data(), kDelay, 0.0);
      problem.SetParameterUpperBound(shared_.data(), kDelay, options_->largest_delay);
    }
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.linear_solver_ordering.reset(order);
    solver.max_num_iterations = 200;
    solver.function_tolerance = 1e-12;
    solver.parameter_tolerance = 1e-10;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    return summary.termination_type == ceres::CONVERGENCE;
  }

  // Solves and finds the spreads in turn until they settle. The heading goes first and alone, and keeps the spread it has
  // then: searched together, a small spread of the position could buy itself a large one of the heading.
  bool settle() {
    const bool position = position_;
    bool good = false;
    for (const bool with_position : {false, true}) {
      if (with_position && !position) {
        break;
      }
      position_ = with_position;
      for (int k = 0; k < kRescalings; ++k) {
        good = solve();
        if (rescale()) {
          break;
        }
      }
    }
    return good;
  }

  // Robust standard deviations of the residuals; true where they hardly changed.
  bool rescale() {
    std::vector<double> heading, position;
    for (const Window& w : windows_) {
      const auto poses = predict(w, *options_, shared_.data(), w.start.data());
      for (std::size_t k = 0; k < poses.size(); ++k) {
        heading.push_back(poses[k][0] - w.poses[k].theta);
        position.push_back(poses[k][1] - w.poses[k].x);
        position.push_back(poses[k][2] - w.poses[k].y);
      }
    }
    // Exact data would leave nothing to divide by.
    const Spreads found{
        position_ ? spreads_.heading : std::max(robust_spread(heading), 1e-9),
        position_ ? std::max(robust_spread(position), 1e-9 * options_->track_width) : spreads_.position};
    const auto near = [](double a, double b) { return std::abs(a - b) <= 0.02 * b; };
    const bool settled = near(found.heading, spreads_.heading) && near(found.position, spreads_.position);
    spreads_ = found;
    return settled;
  }

  // Windows' information on the shared unknowns (their start poses eliminated) and scores, at the solution.
  struct Information {
    SharedMatrix total = SharedMatrix::Zero();
    std::vector<SharedMatrix> window;
    std::vector<SharedVector> score;
    std::size_t outlying = 0;
  };

  [[nodiscard]] Information information() const {
    Information info;
    for (const Window& w : windows_) {
      SharedMatrix A = SharedMatrix::Zero();
      Eigen::Matrix<double, kShared, 3> B = Eigen::Matrix<double, kShared, 3>::Zero();
      Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
      SharedVector score = SharedVector::Zero();
      Eigen::Vector3d own = Eigen::Vector3d::Zero();
      const auto cost = window_cost({&w, options_, spreads_, position_, kInfinity});
      const int rows = cost->num_residuals();
      Eigen::VectorXd residual(rows);
      Eigen::Matrix<double, Eigen::Dynamic, kShared, Eigen::RowMajor> J(rows, +kShared);
      Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> S(rows, 3);
      const std::array<const double*, 2> at = {shared_.data(), w.start.data()};
      std::array<double*, 2> jacobians = {J.data(), S.data()};
      cost->Evaluate(at.data(), residual.data(), jacobians.data());
      const auto add = [&](int first, int n) {
        const Eigen::VectorXd r = residual.segment(first, n);
        const auto Jk = J.middleRows(first, n);
        const auto Sk = S.middleRows(first, n);
        // Second derivative of Huber's loss: along a large residual it is linear.
        const double length = r.norm();
        const double weight = length > options_->huber ? options_->huber / length : 1.0;
        Eigen::MatrixXd curvature = Eigen::MatrixXd::Identity(n, n) * weight;
        if (length > options_->huber) {
          curvature -= weight * r * r.transpose() / (length * length);
        }
        info.outlying += length > 3.0 * std::sqrt(static_cast<double>(n)) ? 1 : 0;
        A += Jk.transpose() * curvature * Jk;
        B += Jk.transpose() * curvature * Sk;
        C += Sk.transpose() * curvature * Sk;
        score -= weight * Jk.transpose() * r;
        own -= weight * Sk.transpose() * r;
      };
      const int each = position_ ? 3 : 1;
      for (int first = 0; first < rows; first += each) {
        add(first, 1);
        if (position_) {
          add(first + 1, 2);
        }
      }
      if (!position_) {
        C.bottomRightCorner<2, 2>().setIdentity();
      }
      const Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix3d> start(C);
      info.window.push_back(A - B * start.solve(B.transpose()));
      info.score.push_back(score - B * start.solve(own));
      info.total += info.window.back();
    }
    return info;
  }

  [[nodiscard]] const SharedVector& shared() const { return shared_; }
  [[nodiscard]] bool is_free(int j) const { return free_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] const Spreads& spreads() const { return spreads_; }

 private:
  std::vector<Window> windows_;
  const KinematicOptions* options_;
  bool position_;
  SharedVector shared_;
  std::array<bool, kShared> free_{};
  Spreads spreads_{0.01, 0.01};
};

struct Spread {
  SharedMatrix covariance = SharedMatrix::Zero();
  std::array<bool, kShared> known{};
  double freedom = 0.0;
};

// Unknowns that the total information does not tell apart are dropped, the least informed first.
Spread spread_of(const Fit& fit, const Fit::Information& info) {
  constexpr double kRankTolerance = 1e-10;
  Spread s;
  std::vector<int> pick;
  for (int j = 0; j < kShared; ++j) {
    if (fit.is_free(j) && info.total(j, j) > 0.0) pick.push_back(j);
  }
  Eigen::MatrixXd H;
  for (;;) {
    H = info.total(pick, pick);
    const Eigen::VectorXd scale = H.diagonal().cwiseSqrt();
    const Eigen::MatrixXd unit = scale.cwiseInverse().asDiagonal() * H * scale.cwiseInverse().asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit);
    if (pick.empty() || eigen.eigenvalues()[0] > kRankTolerance) {
      break;
    }
    Eigen::Index worst = 0;
    eigen.eigenvectors().col(0).cwiseAbs().maxCoeff(&worst);
    pick.erase(pick.begin() + worst);
  }
  const auto m = static_cast<Eigen::Index>(pick.size());
  if (m == 0) {
    return s;
  }
  BlockSums scores(static_cast<std::size_t>(m));
  Eigen::MatrixXd apart = Eigen::MatrixXd::Zero(m, m);  // covariance of the sum if windows were independent
  for (std::size_t k = 0; k < info.score.size(); ++k) {
    const Eigen::MatrixXd without = H - Eigen::MatrixXd(info.window[k](pick, pick));
    const Eigen::LDLT<Eigen::MatrixXd> solver(without);
    Eigen::VectorXd score = info.score[k](pick);
    if (solver.isPositive()) {
      score = H * solver.solve(score);
    }
    scores.add(score);
    apart += score * score.transpose();
  }
  LongRunCovariance spread = long_run_covariance(scores);
  // The larger of the two in every direction, in units of the information.
  const Eigen::VectorXd unit = H.diagonal().cwiseSqrt();
  const Eigen::MatrixXd more =
      unit.cwiseInverse().asDiagonal() * (apart - spread.matrix) * unit.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(more);
  spread.matrix +=
      unit.asDiagonal() *
      (eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * eigen.eigenvectors().transpose()) *
      unit.asDiagonal();
  const Eigen::MatrixXd inverse = H.ldlt().solve(Eigen::MatrixXd::Identity(m, m));
  const Eigen::MatrixXd covariance = inverse * spread.matrix * inverse;
  for (Eigen::Index a = 0; a < m; ++a) {
    s.known[static_cast<std::size_t>(pick[static_cast<std::size_t>(a)])] = true;
    for (Eigen::Index b = 0; b < m; ++b) {
      s.covariance(pick[static_cast<std::size_t>(a)], pick[static_cast<std::size_t>(b)]) = covariance(a, b);
    }
  }
  s.freedom = spread.freedom;
  return s;
}

}  // namespace

KinematicCalibration calibrate_kinematics(const LogTable& log, const KinematicOptions& options) {
  validate(options);
  const auto has = [&](const char* name) {
    return std::find(log.names.begin(), log.names.end(), name) != log.names.end();
  };
  const bool position = has("x") && has("y");
  KinematicCalibration result;
  std::vector<Window> windows = cut(log, options, position, result);
  result.windows = windows.size();
  check::that(windows.size() >= kFewestArcs, "kinematic calibration",
              "at least 8 windows with poses, found " + std::to_string(windows.size()));
  Fit fit(std::move(windows), options, position);
  result.converged = fit.settle();
  const Fit::Information info = fit.information();
  const Spread spread = spread_of(fit, info);
  result.outlying_poses = info.outlying;
  result.heading_spread = fit.spreads().heading;
  result.position_spread = position ? fit.spreads().position : 0.0;
  result.freedom = spread.freedom;

  const SharedVector& s = fit.shared();
  const double t95 = spread.freedom > 0.0 ? student_quantile(0.95, spread.freedom) : kInfinity;
  // A quantity with gradient `by` of the shared unknowns; given up where its interval is wider than ± `widest`.
  const auto quantity = [&](double estimate, const SharedVector& by, double widest, const char* reason) {
    KinematicQuantity q;
    q.estimate = q.lower = q.upper = estimate;
    bool searched = false;
    bool known = true;
    for (int j = 0; j < kShared; ++j) {
      if (by[j] != 0.0 && fit.is_free(j)) {
        searched = true;
        known = known && spread.known[static_cast<std::size_t>(j)];
      }
    }
    if (!searched) {
      return q;
    }
    q.standard_error = known ? std::sqrt(by.dot(spread.covariance * by)) : kInfinity;
    const double half = t95 * q.standard_error;
    q.state = half <= widest ? KinematicState::identified : KinematicState::not_identified;
    if (q.state == KinematicState::not_identified) {
      q.reason = reason;
    }
    q.lower = estimate - half;
    q.upper = estimate + half;
    return q;
  };
  const double r = options.wheel_radius;
  const double D = options.track_width;
  const char* turn = "the log hardly turns: drive arcs and turns on the spot";
  const char* straight = "the log hardly moves forward: drive straight lines and arcs";
  const char* both = "the log does not tell the wheels apart: drive straight and turn both ways";
  SharedVector by = SharedVector::Zero();
  by[kScale] = r * (1.0 + s[kAsymmetry]);
  by[kAsymmetry] = r * s[kScale];
  result.radius_right = quantity(r * s[kScale] * (1.0 + s[kAsymmetry]), by, 0.25 * r, straight);
  by[kScale] = r * (1.0 - s[kAsymmetry]);
  by[kAsymmetry] = -r * s[kScale];
  result.radius_left = quantity(r * s[kScale] * (1.0 - s[kAsymmetry]), by, 0.25 * r, straight);
  by.setZero();
  by[kScale] = D / s[kTurn];
  by[kTurn] = -D * s[kScale] / (s[kTurn] * s[kTurn]);
  const double track = D * s[kScale] / s[kTurn];
  result.track_width = quantity(track, by, 0.25 * std::abs(track), turn);
  by.setZero();
  by[kTurn] = -D / (s[kTurn] * s[kTurn]);
  result.track_at_nominal_radius = quantity(D / s[kTurn], by, 0.25 * std::abs(D / s[kTurn]), turn);
  result.radius_scale = quantity(s[kScale], SharedVector::Unit(kScale), 0.25, straight);
  result.asymmetry = quantity(s[kAsymmetry], SharedVector::Unit(kAsymmetry), 0.1, both);
  result.axle_offset = quantity(D * s[kOffset], D * SharedVector::Unit(kOffset), 0.25 * D, turn);
  result.delay = quantity(s[kDelay], SharedVector::Unit(kDelay), 0.5 * options.largest_delay,
                          "the motion changes too slowly to show a delay: accelerate and turn more briskly");
  return result;
}

}  // namespace wheelwright
