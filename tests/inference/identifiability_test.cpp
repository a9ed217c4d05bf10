// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/identifiability.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::inference::identifiability_test {
namespace {

using testing_support::block_of;
using testing_support::Random;

ParameterWords words(const std::string& name, const std::string& unit, const std::string& excite = {}) {
  return {name, unit, excite, kind_of(name)};
}

const std::vector<ParameterWords> kAxis = {words("mass", "kg", "accelerate"), words("armature", "kg·m²", "accelerate"),
                                           words("viscous", "N·s/m", "move at different speeds"),
                                           words("coulomb", "N", "move in both directions")};

identify::LeastSquares folded(const Eigen::MatrixXd& Y) {
  identify::LeastSquares rows(static_cast<std::size_t>(Y.cols()));
  rows.add(block_of(Y, Eigen::VectorXd::Zero(Y.rows()), 1));
  return rows;
}

// Columns of acceleration, speed and direction of a mixed motion; the second is 4.25 times the first.
Eigen::MatrixXd axis_rows(std::uint64_t seed) {
  Random random(seed);
  Eigen::MatrixXd Y(500, 4);
  for (Eigen::Index k = 0; k < Y.rows(); ++k) {
    const double a = random.symmetric();
    const double v = random.symmetric();
    Y.row(k) << a, 4.25 * a, v, std::copysign(1.0, v);
  }
  return Y;
}

TEST(Identifiability, NamesTwoParametersOnOneMotion) {
  const Identifiability found = identifiability(identifiability_input(folded(axis_rows(1)), kAxis));
  EXPECT_EQ(found.rank, 3);
  EXPECT_EQ(found.noise_rank, 3);
  EXPECT_EQ(found.base, (std::vector<Eigen::Index>{0, 2, 3}));
  ASSERT_EQ(found.unseen.size(), 1U);
  EXPECT_EQ(found.unseen[0].why, Unseen::not_separated);
  // 1·4.25 − 4.25·1 = 0 in exact arithmetic: the null space is (−4.25, 1, 0, 0).
  EXPECT_LE((found.unseen[0].direction - Eigen::Vector4d(-4.25, 1.0, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_EQ(found.unseen[0].words,
            "mass and armature cannot be told apart here: only mass + 4.2·armature (mass in kg, armature in kg·m²) is "
            "seen");
  ASSERT_EQ(found.unseen[0].manoeuvres.size(), 1U);
  EXPECT_EQ(found.unseen[0].manoeuvres[0],
            "no motion may tell mass and armature apart: state one of them, or drive once more with a load of known "
            "mass");
  EXPECT_EQ(found.seen[1].words, "viscous (N·s/m)");
}

// Integers: y_3 = 2y_1 − y_2, y_4 = 0. Null space by hand: (2, −1, −1, 0) and (0, 0, 0, 1).
TEST(Identifiability, FindsAHandComputedNullSpace) {
  Eigen::MatrixXd Y(6, 4);
  Y << 1, 2, 0, 0, 3, 1, 5, 0, -1, 4, -6, 0, 2, 2, 2, 0, 0, 1, -1, 0, 5, -3, 13, 0;
  const Identifiability found = identifiability(identifiability_input(
      folded(Y), {words("a", "N"), words("b", "N"), words("c", "N"), words("d", "N", "turn on the spot")}));
  EXPECT_EQ(found.rank, 2);
  EXPECT_EQ(found.condition, std::numeric_limits<double>::infinity());
  ASSERT_EQ(found.unseen.size(), 2U);
  Eigen::Vector4d first = found.unseen[0].direction;
  EXPECT_LE((Y * first).norm(), 1e-12 * Y.norm());
  EXPECT_NEAR(first[0] / first[1], -2.0, 1e-12);
  EXPECT_NEAR(first[0] / first[2], -2.0, 1e-12);
  EXPECT_EQ(found.unseen[1].why, Unseen::not_moved);
  EXPECT_EQ(found.unseen[1].words, "d: its motion never occurs in the log");
  EXPECT_EQ(found.unseen[1].manoeuvres, std::vector<std::string>{"turn on the spot"});
  // What is seen in place of a base parameter has the same product with every row.
  Eigen::Vector4d theta(0.7, -0.3, 1.1, 9.0);
  Eigen::VectorXd regrouped = Eigen::VectorXd::Zero(6);
  for (std::size_t i = 0; i < found.base.size(); ++i) {
    regrouped += Y.col(found.base[i]) * found.seen[i].coefficients.dot(theta);
  }
  EXPECT_LE((regrouped - Y * theta).norm(), 1e-12 * (Y * theta).norm());
}

// Columns that differ by 1e-8 of themselves: the triangular factor tells them apart (10⁻⁸ against a tolerance of
// 10⁻¹²); second moments would hold it as 10⁻¹⁶.
TEST(Identifiability, TellsNearlyEqualColumnsApartByTheFactor) {
  Random random(3);
  Eigen::MatrixXd Y = random.matrix(400, 2);
  Y.col(1) = Y.col(0) + 1e-8 * Y.col(1);
  const std::vector<ParameterWords> two = {words("mass", "kg"), words("payload", "kg")};
  const Identifiability by_factor = identifiability(identifiability_input(folded(Y), two));
  EXPECT_EQ(by_factor.rank, 2);
  EXPECT_GT(by_factor.condition, 1e7);
}

// Orthogonal columns: the second of size 0.02 a row, noise of 0.01 there: 2 is less than 3 times; 0.005 would do.
TEST(Identifiability, CountsDirectionsMadeOfNoise) {
  Eigen::MatrixXd Y(400, 2);
  for (Eigen::Index k = 0; k < 400; ++k) {
    Y.row(k) << (k % 2 == 0 ? 1.0 : -1.0), (k % 4 < 2 ? 0.02 : -0.02);
  }
  IdentifiabilityInput input =
      identifiability_input(folded(Y), {words("mass", "kg", "accelerate"), words("drag", "N", "drive fast")});
  input.noise = 400.0 * Eigen::Vector2d(1e-4, 1e-4).asDiagonal().toDenseMatrix();
  const Identifiability noisy = identifiability(input);
  EXPECT_EQ(noisy.rank, 2);
  EXPECT_EQ(noisy.noise_rank, 1);
  ASSERT_EQ(noisy.unseen.size(), 1U);
  EXPECT_EQ(noisy.unseen[0].why, Unseen::noise);
  EXPECT_EQ(noisy.unseen[0].words, "sensor noise alone would show as much: the log says nothing sure about drag (N)");
  EXPECT_EQ(noisy.unseen[0].manoeuvres, std::vector<std::string>{"drive fast"});
  input.noise = 400.0 * Eigen::Vector2d(1e-4, 0.25e-4).asDiagonal().toDenseMatrix();
  EXPECT_EQ(identifiability(input).noise_rank, 2);
}

// Covariance s_i s_j (16 uuᵀ + 0.01 vvᵀ) for u = (0.8, −0.6), v = (0.6, 0.8) and sizes (2, 5): along u four times what
// is known before, along v a tenth.
TEST(Identifiability, SaysWhatIsKnownLittleAndWhatBest) {
  const Eigen::Vector2d u(0.8, -0.6), v(0.6, 0.8), size(2.0, 5.0);
  IdentifiabilityInput input = identifiability_input(folded(Random(4).matrix(300, 2)), {kAxis[2], kAxis[3]});
  const Eigen::Matrix2d relative = 16.0 * u * u.transpose() + 0.01 * v * v.transpose();
  input.covariance = size.asDiagonal() * relative * size.asDiagonal();
  input.size = size;
  const Identifiability found = identifiability(input);
  ASSERT_EQ(found.known.size(), 2U);
  EXPECT_NEAR(found.known[0].relative_error, 0.1, 1e-12);
  EXPECT_EQ(found.known[0].words, "1.9·viscous + coulomb (viscous in N·s/m, coulomb in N)");  // 0.6/2 : 0.8/5
  ASSERT_EQ(found.unseen.size(), 1U);
  EXPECT_EQ(found.unseen[0].why, Unseen::imprecise);
  // viscous/2·0.8 − coulomb/5·0.6, the first brought to one: 4·2/0.8 = 10.
  EXPECT_NEAR(found.unseen[0].standard_error, 10.0, 1e-9);
  EXPECT_EQ(
      found.unseen[0].words,
      "the log says little about viscous − 0.3·coulomb (viscous in N·s/m, coulomb in N): its standard error is 10");
  EXPECT_EQ(found.unseen[0].manoeuvres,
            std::vector<std::string>{"drive in both directions and at many speeds, from slow to fast"});
}

TEST(Identifiability, RefusesShapesThatDisagree) {
  IdentifiabilityInput input = identifiability_input(folded(Random(5).matrix(30, 2)), {words("a", ""), words("b", "")});
  input.noise = Eigen::MatrixXd::Zero(3, 3);
  EXPECT_THROW((void)identifiability(input), InvalidArgument);
  input.noise.resize(0, 0);
  input.size = Eigen::Vector2d(1.0, 0.0);
  EXPECT_THROW((void)identifiability(input), InvalidArgument);
}

TEST(DirectionWords, ReadAsSentences) {
  const Eigen::Vector4d one = Eigen::Vector4d::Ones();
  EXPECT_EQ(combination_in_words(Eigen::Vector4d(1.0, 0.0, 0.0, 0.0), kAxis, one), "mass (kg)");
  EXPECT_EQ(combination_in_words(Eigen::Vector4d(0.0, 0.0, 0.8, -0.6), kAxis, one),
            "0.8·viscous − 0.6·coulomb (viscous in N·s/m, coulomb in N)");
  EXPECT_EQ(combination_in_words(Eigen::Vector4d(1.0, 0.05, 0.0, 0.0), kAxis, one), "mass (kg)");
  EXPECT_EQ(combination_in_words(Eigen::Vector4d::Zero(), kAxis, one), "nothing");
  EXPECT_EQ(largest_part_one(Eigen::Vector4d(0.0, 2.0, -4.0, 0.0), one), Eigen::Vector4d(0.0, 0.5, -1.0, 0.0));
  EXPECT_EQ(largest_part_one(Eigen::Vector4d(0.0, -2.0, 4.0, 0.0), one), Eigen::Vector4d(0.0, 0.5, -1.0, 0.0));
  EXPECT_EQ(kind_of("viscous_linear"), TermKind::viscous);
  EXPECT_EQ(kind_of("r_yaw_inertia"), TermKind::inertia);
  EXPECT_EQ(kind_of("slope"), TermKind::other);
  EXPECT_EQ(missing_manoeuvres({0, 2}, kAxis),
            std::vector<std::string>{"speed up and brake often, and hold constant speeds in between"});
  EXPECT_EQ(missing_manoeuvres({3}, kAxis), std::vector<std::string>{"move in both directions"});
}

}  // namespace
}  // namespace wheelwright::inference::identifiability_test
