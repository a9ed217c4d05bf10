// SPDX-License-Identifier: Apache-2.0
// Least squares by moments, with its covariance, and instrumental variables, at p = 8 on a million rows in memory: next
// to a bare read of the same numbers, and to LAPACK's dgels (to which its copy of the matrix, which it destroys, is
// charged).
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "identify/estimate.hpp"
#include "tests/benchmarks/bench.hpp"

#ifdef WHEELWRIGHT_LAPACK
extern "C" void dgels_(const char* trans, const int* m, const int* n, const int* nrhs, double* a, const int* lda,
                       double* b, const int* ldb, double* work, const int* lwork, int* info);
#endif

namespace wheelwright::bench::identify_bench {
namespace {

constexpr std::size_t kRows = 1000000;
constexpr Eigen::Index kParameters = 8;
constexpr int kRepetitions = 7;

/// `columns` smooth columns like those of a filtered drive, and y = Yθ + noise of a tenth.
RegressionBlock rows(Eigen::Index columns) {
  std::mt19937_64 engine(1);
  const auto uniform = [&] { return static_cast<double>(engine() >> 11U) * 0x1.0p-52 - 1.0; };
  RegressionBlock block;
  block.resize(kRows, 1, static_cast<std::size_t>(columns));
  block.dY.setZero();
  block.dy.setZero();
  Eigen::VectorXd state = Eigen::VectorXd::Zero(columns);
  for (std::size_t k = 0; k < kRows; ++k) {
    block.sample[k] = k;
    block.t[k] = 0.005 * static_cast<double>(k);
    const auto at = static_cast<Eigen::Index>(k);
    for (Eigen::Index j = 0; j < columns; ++j) {
      state[j] = 0.95 * state[j] + uniform();
    }
    block.Y.row(at) = state.transpose();
    block.y[at] = state.head(kParameters).sum() + 0.1 * uniform();
  }
  return block;
}

#ifdef WHEELWRIGHT_LAPACK
Eigen::VectorXd dgels(const Eigen::MatrixXd& Y, const Eigen::VectorXd& y) {
  Eigen::MatrixXd a = Y;
  Eigen::VectorXd b = y;
  const int m = static_cast<int>(Y.rows()), n = static_cast<int>(Y.cols()), one = 1;
  int info = 0, query = -1;
  double size = 0.0;
  dgels_("N", &m, &n, &one, a.data(), &m, b.data(), &m, &size, &query, &info);
  const int length = static_cast<int>(size);
  std::vector<double> work(static_cast<std::size_t>(length));
  dgels_("N", &m, &n, &one, a.data(), &m, b.data(), &m, work.data(), &length, &info);
  return b.head(n);
}
#endif

Eigen::VectorXd by_moments(const RegressionBlock& block) {
  identify::RegressionMoments sums(1, kParameters);
  sums.add(block);
  return identify::ordinary_least_squares(sums).theta;
}

void moments(Form form) {
  const RegressionBlock block = rows(kParameters);
  const auto ours = [&] { DoNotOptimize(by_moments(block)); };
  const auto against = [&](const char* peer, const Work& theirs, const std::string& remark) {
    compare(form, {"identify/moments", kRows, kParameters, 1, peer, [&](double) { return remark; }}, ours, theirs,
            kRepetitions);
  };
  against(
      "bare read", [&] { DoNotOptimize(block.Y.sum() + block.y.sum()); }, "Y and y, 72 MB");
#ifdef WHEELWRIGHT_LAPACK
  const Eigen::MatrixXd Y = block.Y;
  const Eigen::VectorXd theirs = dgels(Y, block.y);
  const Eigen::VectorXd difference = by_moments(block) - theirs;
  against(
      "lapack dgels", [&] { DoNotOptimize(dgels(Y, block.y)); },
      fmt::format("largest relative difference {:.1e}", (difference.array() / theirs.array()).abs().maxCoeff()));
#endif
}

void instruments(Form form) {
  const RegressionBlock both = rows(2 * kParameters);
  const RegressionBlock block = rows(kParameters);
  const auto ours = [&] {
    identify::RegressionMoments sums(1, kParameters, true);
    sums.add(both);
    DoNotOptimize(identify::instrumental_variables(sums).theta);
  };
  const auto note = [](double) { return std::string("covariance under autocorrelation included"); };
  compare(
      form, {"identify/instrumental_variables", kRows, kParameters, 1, "identify/moments", note}, ours,
      [&] { DoNotOptimize(by_moments(block)); }, kRepetitions);
}

const bool registered_moments = register_bench("identify/moments", moments);
const bool registered_instruments = register_bench("identify/instrumental_variables", instruments);

}  // namespace
}  // namespace wheelwright::bench::identify_bench
