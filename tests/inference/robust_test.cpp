// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <boost/math/distributions/students_t.hpp>

#include "core/error.hpp"
#include "identify/inference/constrained.hpp"
#include "identify/inference/robust.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::inference::robust_test {
namespace {

using testing_support::Autoregression;
using testing_support::block_of;
using testing_support::Random;

const std::vector<Loss> every_loss = {Loss::squared, Loss::huber, Loss::cauchy, Loss::tukey};

LossFunction tuned(Loss loss) { return {loss, tuning_constant(loss)}; }

struct Problem {
  Eigen::MatrixXd Y;
  Eigen::VectorXd y;
  std::size_t outputs = 2;

  [[nodiscard]] RobustFit fit(const RobustOptions& options) const {
    core::RegressionTable table(block_of(Y, y, outputs));
    return robust_fit(table, options);
  }
};

/// Two outputs of different noise and columns of different size; every tenth instant has a gross error of 50 standard
/// deviations, always to the same side.
Problem contaminated(std::uint64_t seed, Eigen::Index instants, double share = 0.1) {
  Random random(seed);
  Problem a;
  a.Y = random.matrix(2 * instants, 3);
  a.Y.col(1) *= 100.0;
  a.Y.col(2).array() += 1.0;
  a.y = a.Y * Eigen::Vector3d(2.0, 0.05, 1.0);
  for (Eigen::Index row = 0; row < a.y.size(); ++row) {
    const double sd = row % 2 == 0 ? 0.1 : 0.4;
    a.y[row] += random.unit() < share ? 50.0 * sd : sd * random.normal();
  }
  return a;
}

/// Reweighted least squares with given scales, by normal equations in plain code.
Eigen::VectorXd reweighted(const Problem& a, const LossFunction& loss, const Eigen::VectorXd& scales,
                           Eigen::VectorXd theta) {
  for (int round = 0; round < 2000; ++round) {
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(a.Y.cols(), a.Y.cols());
    Eigen::VectorXd right = Eigen::VectorXd::Zero(a.Y.cols());
    for (Eigen::Index row = 0; row < a.y.size(); ++row) {
      const double s = scales[row % scales.size()];
      const double u = (a.y[row] - a.Y.row(row).dot(theta)) / s;
      const double size = std::abs(u), c = loss.c;
      double w = 1.0;
      if (loss.loss == Loss::huber) {
        w = std::min(1.0, c / size);
      } else if (loss.loss == Loss::cauchy) {
        w = 1.0 / (1.0 + u * u / c / c);
      } else if (loss.loss == Loss::tukey) {
        w = size < c ? std::pow(1.0 - u * u / c / c, 2) : 0.0;
      }
      gram += w / (s * s) * a.Y.row(row).transpose() * a.Y.row(row);
      right += w / (s * s) * a.y[row] * a.Y.row(row).transpose();
    }
    theta = gram.ldlt().solve(right);
  }
  return theta;
}

Eigen::VectorXd scales_of(const RobustFit& fit) {
  Eigen::VectorXd scales(static_cast<Eigen::Index>(fit.outputs.size()));
  for (std::size_t i = 0; i < fit.outputs.size(); ++i) {
    scales[static_cast<Eigen::Index>(i)] = fit.outputs[i].scale;
  }
  return scales;
}

TEST(Loss, DerivativesAndWeightsBelongToRho) {
  for (const Loss loss : every_loss) {
    const LossFunction f = tuned(loss);
    for (double u = -7.03; u < 7.0; u += 0.11) {
      constexpr double h = 1e-5;
      EXPECT_NEAR((f.rho(u + h) - f.rho(u - h)) / (2.0 * h), f.psi(u), 1e-9) << u;
      EXPECT_NEAR((f.psi(u + h) - f.psi(u - h)) / (2.0 * h), f.psi_slope(u), 1e-8) << u;
      EXPECT_NEAR(f.weight(u) * u, f.psi(u), 1e-14);
      const LossFunction::Root root = f.root(u);
      EXPECT_NEAR(0.5 * root.value * root.value, f.rho(u), 1e-13);
      EXPECT_NEAR(root.value * root.slope, f.psi(u), 1e-13);
      EXPECT_EQ(f.weight(u) < 0.5, std::abs(u) > f.half_weight()) << u;
    }
    EXPECT_EQ(f.root(0.0).slope, 1.0);
    EXPECT_EQ(f.weight(0.0), 1.0);
  }
  // The closed forms far out.
  EXPECT_NEAR(tuned(Loss::huber).rho(10.0), 1.345 * 10.0 - 1.345 * 1.345 / 2.0, 1e-13);
  EXPECT_NEAR(tuned(Loss::cauchy).rho(10.0), 0.5 * 2.385 * 2.385 * std::log1p(100.0 / 2.385 / 2.385), 1e-13);
  EXPECT_NEAR(tuned(Loss::tukey).rho(10.0), 4.685 * 4.685 / 6.0, 1e-13);
}

// Asymptotic efficiency (E ψ')²/E ψ² under the standard normal, by the trapezoidal rule (exact to rounding for smooth
// integrands; kinks leave h²).
TEST(Loss, ConstantsGive95PerCentEfficiency) {
  for (const Loss loss : {Loss::huber, Loss::cauchy, Loss::tukey}) {
    const LossFunction f = tuned(loss);
    double slope = 0.0, square = 0.0;
    constexpr double h = 1e-4;
    for (int k = -100000; k <= 100000; ++k) {
      const double u = h * k, density = std::exp(-0.5 * u * u) / std::sqrt(2.0 * std::numbers::pi);
      slope += f.psi_slope(u) * density * h;
      square += f.psi(u) * f.psi(u) * density * h;
    }
    EXPECT_NEAR(slope * slope / square, 0.95, 2e-4);
  }
}

TEST(RobustFit, IsThatOfReweightingByHand) {
  for (const Loss loss : every_loss) {
    const Problem a = contaminated(1, 500);
    const RobustFit fit = a.fit({.loss = loss});
    EXPECT_EQ(fit.status, RobustStatus::converged);
    EXPECT_TRUE(fit.solver_converged);
    EXPECT_EQ(fit.rank, 3);
    const Eigen::VectorXd huber = reweighted(a, tuned(Loss::huber), scales_of(fit), Eigen::VectorXd::Zero(3));
    const Eigen::VectorXd expected = reweighted(a, tuned(loss), scales_of(fit), huber);
    for (Eigen::Index j = 0; j < 3; ++j) {
      EXPECT_NEAR(fit.estimate[j], expected[j], 1e-7 * std::abs(expected[j])) << static_cast<int>(loss) << " " << j;
    }
    // The scale is that of the fit of nearly least absolute values; its rounds end before a tenth of its own standard
    // error, 1.17/√500.
    const Eigen::VectorXd start = reweighted(a, {Loss::huber, 0.05}, scales_of(fit), huber);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const Eigen::VectorXd r = (a.y - a.Y * start)(Eigen::seqN(i, 500, 2)).cwiseAbs();
      std::vector<double> sizes(r.begin(), r.end());
      std::sort(sizes.begin(), sizes.end());
      EXPECT_NEAR(scales_of(fit)[i], 0.5 * (sizes[249] + sizes[250]) / 0.6744897501960817, 5e-3 * scales_of(fit)[i]);
    }
  }
}

// Ceres by itself stops where reweighting does.
TEST(MEstimate, MeetsTheScoreEquations) {
  for (const Loss loss : every_loss) {
    const Problem a = contaminated(2, 400);
    const Eigen::Vector2d scales(0.12, 0.5);
    const Eigen::VectorXd start = reweighted(a, tuned(Loss::huber), scales, Eigen::VectorXd::Zero(3));
    const MEstimate found = m_estimate(block_of(a.Y, a.y, 2), scales, tuned(loss), start);
    EXPECT_TRUE(found.converged) << found.message;
    const Eigen::VectorXd expected = reweighted(a, tuned(loss), scales, start);
    for (Eigen::Index j = 0; j < 3; ++j) {
      EXPECT_NEAR(found.theta[j], expected[j], 1e-6 * std::abs(expected[j])) << static_cast<int>(loss);
    }
  }
}

TEST(RobustFit, FollowsTheLawsOfRegression) {
  const Problem a = contaminated(3, 600);
  for (const Loss loss : {Loss::huber, Loss::cauchy, Loss::tukey}) {
    const RobustFit fit = a.fit({.loss = loss});
    const auto expect = [&](const Problem& b, const Eigen::VectorXd& theta, double scale, const char* law) {
      const RobustFit other = b.fit({.loss = loss});
      for (Eigen::Index j = 0; j < 3; ++j) {
        EXPECT_NEAR(other.estimate[j], theta[j], 1e-6 * (std::abs(theta[j]) + fit.standard_error[j])) << law;
      }
      EXPECT_NEAR(other.outputs[0].scale, scale * fit.outputs[0].scale, 1e-5 * scale * fit.outputs[0].scale) << law;
    };
    Problem scaled = a;
    scaled.y *= 1000.0;
    expect(scaled, 1000.0 * fit.estimate, 1000.0, "scale");
    Problem shifted = a;
    const Eigen::Vector3d shift(5.0, -0.3, 2.0);
    shifted.y += a.Y * shift;
    expect(shifted, fit.estimate + shift, 1.0, "regression");
    Problem mixed = a;
    Eigen::Matrix3d M;
    M << 1.0, 2.0, 0.0, 0.0, 0.1, 0.5, 3.0, 0.0, 1.0;
    mixed.Y = a.Y * M;
    expect(mixed, M.inverse() * fit.estimate, 1.0, "affine");
    Problem reversed = a;
    for (Eigen::Index k = 0; k < 600; ++k) {
      reversed.Y.middleRows(2 * k, 2) = a.Y.middleRows(2 * (599 - k), 2);
      reversed.y.segment(2 * k, 2) = a.y.segment(2 * (599 - k), 2);
    }
    expect(reversed, fit.estimate, 1.0, "permutation");
  }
}

// Tenth of the rows wrong by 50 standard deviations, all to one side: least squares is off by five of them in the
// column with a mean, the redescending losses by less than the noise explains, and what is wrong is named.
TEST(RobustFit, WithstandsGrossErrors) {
  const Eigen::Vector3d truth(2.0, 0.05, 1.0);
  for (const double share : {0.1, 0.3}) {
    const Problem a = contaminated(4, 3000, share);
    const RobustFit squares = a.fit({.loss = Loss::squared});
    EXPECT_GT(std::abs(squares.estimate[2] - 1.0), 50.0 * 0.1 * share * 0.5);
    for (const Loss loss : {Loss::cauchy, Loss::tukey}) {
      const RobustFit fit = a.fit({.loss = loss});
      for (Eigen::Index j = 0; j < 3; ++j) {
        // Five standard errors, and the pull that remains to Cauchy's loss: c²/|u| of a standard deviation for each.
        const double pull = loss == Loss::cauchy && j == 2 ? share * 2.385 * 2.385 / 50.0 * 0.4 * 2.0 : 0.0;
        EXPECT_NEAR(fit.estimate[j], truth[j], 5.0 * fit.standard_error[j] + pull) << share;
      }
    }
    const RobustFit fit = a.fit({.loss = Loss::tukey});
    for (const OutputWeights& output : fit.outputs) {
      EXPECT_NEAR(output.rejected, share, 4.0 * std::sqrt(share * (1.0 - share) / 3000.0));
    }
    ASSERT_EQ(fit.episodes.size(), 10u);
    for (std::size_t k = 0; k < fit.episodes.size(); ++k) {
      EXPECT_GT(fit.episodes[k].worst, 20.0);
      EXPECT_TRUE(k == 0 || std::abs(fit.episodes[k].worst) <= std::abs(fit.episodes[k - 1].worst));
    }
  }
}

TEST(RobustFit, NamesTheGlitch) {
  Random random(5);
  Problem a{random.matrix(4000, 2), {}, 2};
  a.y = a.Y * Eigen::Vector2d(1.0, 2.0) + 0.1 * random.matrix(4000, 1);
  for (Eigen::Index k = 700; k < 730; ++k) {
    a.y[2 * k + 1] -= 5.0 + 0.01 * static_cast<double>(k == 711);
    a.Y.row(2 * k + 1).setConstant(0.5);
    a.y[2 * k + 1] = 1.5 - 5.0 - (k == 711 ? 1.0 : 0.0);
  }
  const RobustFit fit = a.fit({.loss = Loss::tukey, .most_episodes = 3});
  ASSERT_GE(fit.episodes.size(), 1u);
  const Episode& worst = fit.episodes[0];
  EXPECT_EQ(worst.output, 1u);
  EXPECT_LE(worst.first_time, 7.00);
  EXPECT_GE(worst.last_time, 7.29);
  EXPECT_EQ(worst.worst_sample, 711u);
  EXPECT_LT(worst.worst, -5.0);
  EXPECT_LE(fit.episodes.size(), 3u);
  EXPECT_NEAR(fit.outputs[1].rejected, 30.0 / 2000.0, 1e-3);
}

// Noise-free rows but for one in five: the scale falls to its floor and the truth is found to rounding.
TEST(RobustFit, FindsAnExactFitAmongGrossErrors) {
  Random random(6);
  Problem a{random.matrix(500, 2), {}, 1};
  a.y = a.Y * Eigen::Vector2d(3.0, -1.0);
  for (Eigen::Index row = 0; row < 500; row += 5) {
    a.y[row] += 10.0 * random.symmetric();
  }
  const RobustFit fit = a.fit({.loss = Loss::tukey});
  EXPECT_TRUE(fit.exact_fit);
  EXPECT_LT((fit.estimate - Eigen::Vector2d(3.0, -1.0)).norm(), 1e-9);
}

// Variance of least squares over that of the robust fit, over runs of Gaussian noise. The two are correlated by
// √0.95, so that the logarithm of the ratio of M·p independent pairs has the standard deviation 2√((1 − 0.95)/(M·p)).
TEST(RobustFit, IsNearly95PerCentEfficientAtGaussianNoise) {
  constexpr int runs = 400;
  constexpr Eigen::Index rows = 300, p = 3;
  Random random(7);
  const Problem design{random.matrix(rows, p), {}, 1};
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(design.Y);
  const Eigen::MatrixXd R = qr.matrixQR().topRows(p).triangularView<Eigen::Upper>();
  for (const Loss loss : {Loss::huber, Loss::cauchy, Loss::tukey}) {
    double of_squares = 0.0, of_robust = 0.0;
    for (int run = 0; run < runs; ++run) {
      Problem a = design;
      a.y = Eigen::VectorXd::NullaryExpr(rows, [&] { return random.normal(); });
      of_squares += (R * qr.solve(a.y)).squaredNorm();
      of_robust += (R * a.fit({.loss = loss}).estimate).squaredNorm();
    }
    const double three = 3.0 * 2.0 * std::sqrt(0.05 / (runs * p));
    RecordProperty("efficiency_" + std::to_string(static_cast<int>(loss)), std::to_string(of_squares / of_robust));
    EXPECT_NEAR(std::log(of_squares / of_robust), std::log(0.95), three) << static_cast<int>(loss);
  }
}

// A drive with residuals that remember a quarter of a second and 5 % glitches: intervals of 95 % cover, 400 runs.
TEST(RobustFit, IntervalsAreHonestUnderAutocorrelatedResiduals) {
  constexpr int runs = 400;
  constexpr Eigen::Index count = 2000;
  const Eigen::MatrixXd Y = Eigen::MatrixXd::NullaryExpr(count, 2, [](Eigen::Index k, Eigen::Index j) {
    const double t = 0.01 * static_cast<double>(k), f = 1.0 + 0.7 * static_cast<double>(j);
    return std::sin(f * t) + 0.5 * std::cos(2.3 * f * t);
  });
  for (const Loss loss : {Loss::huber, Loss::tukey}) {
    int covered = 0;
    for (int run = 0; run < runs; ++run) {
      Autoregression noise(static_cast<std::uint64_t>(1000 + run), 0.9);
      Random random(static_cast<std::uint64_t>(run));
      Problem a{Y, Y * Eigen::Vector2d(1.0, 2.0), 1};
      for (double& value : a.y) {
        value += noise.next() + (random.unit() < 0.05 ? 20.0 * random.symmetric() : 0.0);
      }
      const RobustFit fit = a.fit({.loss = loss});
      const double t = boost::math::quantile(boost::math::students_t(fit.freedom), 0.975);
      covered += std::abs(fit.estimate[0] - 1.0) <= t * fit.standard_error[0] ? 1 : 0;
    }
    RecordProperty("covered_" + std::to_string(static_cast<int>(loss)), covered);
    EXPECT_NEAR(static_cast<double>(covered) / runs, 0.95, 3.0 * std::sqrt(0.05 * 0.95 / runs));
  }
}

TEST(RobustFit, ThinnedLogsAreFinishedOnAllRows) {
  const Problem a = contaminated(8, 3000);
  for (const Loss loss : {Loss::huber, Loss::tukey}) {
    const RobustFit whole = a.fit({.loss = loss});
    const RobustFit thin = a.fit({.loss = loss, .most_instants = 1000});
    EXPECT_EQ(whole.held, 3000u);
    EXPECT_EQ(thin.held, 750u);
    EXPECT_EQ(thin.instants, 3000u);
    EXPECT_EQ(thin.status, RobustStatus::converged);
    // With the thinned rows' scales, the solution of all rows.
    const Eigen::VectorXd expected = reweighted(a, tuned(loss), scales_of(thin), whole.estimate);
    for (Eigen::Index j = 0; j < 3; ++j) {
      EXPECT_NEAR(thin.estimate[j], expected[j], 1e-6 * std::abs(expected[j]));
    }
  }
}

// Optimality under constraints, with a loss: gradient of 2Σρ and multipliers cancel; the constraints of a footprint
// are a box in other coordinates, those of a fan are not.
TEST(RobustFit, FulfilsTheOptimalityConditionsUnderConstraints) {
  const Problem a = contaminated(9, 800);
  const auto footprint =
      physical_consistency({{"mass", 1.0, "", true}, {"yaw_inertia", 0.01, "", true}, {"offset", 1.0, ""}}, 1.2);
  std::vector<LinearConstraint> fan;
  for (const double slope : {-1.0, 0.0, 1.0}) {
    fan.push_back({Eigen::Vector3d(slope, 100.0, 0.5), 3.0 + slope, "fan", ""});
  }
  fan.push_back({Eigen::Vector3d(0.0, 0.0, -1.0), -1.2, "offset", ""});
  BoxCoordinates box;
  EXPECT_TRUE(find_box(std::vector<LinearConstraint>(footprint.begin() + 1, footprint.end()), 3, box));
  EXPECT_FALSE(find_box(fan, 3, box));
  const std::vector<std::vector<LinearConstraint>> sets = {{footprint.begin() + 1, footprint.end()}, footprint, fan};
  for (const auto& constraints : sets) {
    for (const Loss loss : every_loss) {
      const LossFunction f = tuned(loss);
      const RobustFit fit = a.fit({.loss = loss, .constraints = constraints});
      EXPECT_EQ(fit.status, RobustStatus::converged);
      ASSERT_FALSE(fit.active.empty());
      Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
      for (Eigen::Index row = 0; row < a.y.size(); ++row) {
        const double s = fit.outputs[static_cast<std::size_t>(row % 2)].scale;
        gradient -= 2.0 * f.psi((a.y[row] - a.Y.row(row).dot(fit.estimate)) / s) / s * a.Y.row(row).transpose();
      }
      const Eigen::Vector3d size = gradient.cwiseAbs() + Eigen::Vector3d(1.0, 100.0, 1.0) * a.Y.rows();
      for (const ActiveConstraint& active : fit.active) {
        const LinearConstraint& constraint = constraints[active.index];
        EXPECT_GE(active.multiplier, 0.0);
        EXPECT_NEAR(constraint.a.dot(fit.estimate), constraint.b, 1e-9 * constraint.a.norm());
        gradient += active.multiplier * constraint.a;
        // Across a constraint that holds the estimate there is no variance.
        if (active.multiplier > 0.0) {
          EXPECT_NEAR(constraint.a.dot(fit.covariance * constraint.a), 0.0,
                      1e-9 * constraint.a.squaredNorm() * fit.covariance.norm());
        }
      }
      for (const LinearConstraint& constraint : constraints) {
        EXPECT_LE(constraint.a.dot(fit.estimate), constraint.b + 1e-9 * constraint.a.norm());
      }
      EXPECT_LT(gradient.cwiseQuotient(size).norm(), 1e-6) << static_cast<int>(loss);
    }
  }
}

TEST(RobustFit, ConstraintsThatContradictAreSaid) {
  const Problem a = contaminated(10, 100);
  const RobustFit fit = a.fit({.constraints = {{Eigen::Vector3d(1.0, 0.0, 0.0), 0.0, "below", ""},
                                               {Eigen::Vector3d(-1.0, 0.0, 0.0), -1.0, "above", ""}}});
  EXPECT_EQ(fit.status, RobustStatus::infeasible);
  EXPECT_EQ(fit.active.size(), 2u);
}

TEST(RobustFit, AColumnThatIsNotExcitedStaysZero) {
  Problem a = contaminated(11, 300);
  const Eigen::VectorXd dead = Eigen::VectorXd::Zero(a.Y.rows());
  Problem wide{Eigen::MatrixXd(a.Y.rows(), 4), a.y, 2};
  wide.Y << a.Y, dead;
  const RobustFit three = a.fit({.loss = Loss::tukey}), four = wide.fit({.loss = Loss::tukey});
  EXPECT_EQ(four.rank, 3);
  EXPECT_EQ(four.estimate[3], 0.0);
  EXPECT_EQ(four.standard_error[3], 0.0);
  EXPECT_LT((four.estimate.head(3) - three.estimate).cwiseQuotient(three.standard_error).norm(), 1e-5);
}

TEST(RobustFit, MisuseIsRefused) {
  const Problem a = contaminated(12, 20);
  EXPECT_THROW((void)a.fit({.tuning = -1.0}), InvalidArgument);
  EXPECT_THROW((void)a.fit({.tuning = std::nan("")}), InvalidArgument);
  EXPECT_THROW((void)a.fit({.most_instants = 2}), InvalidArgument);
  EXPECT_THROW((void)a.fit({.most_passes = 0}), InvalidArgument);
  EXPECT_THROW((void)a.fit({.constraints = {{Eigen::Vector2d::Ones(), 0.0, "", ""}}}), InvalidArgument);
  RegressionBlock none;
  none.resize(0, 1, 2);
  core::RegressionTable empty(none);
  EXPECT_THROW((void)robust_fit(empty), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::inference::robust_test
