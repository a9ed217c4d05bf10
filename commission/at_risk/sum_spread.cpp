// SPDX-License-Identifier: Apache-2.0
#include "commission/at_risk/sum_spread.hpp"

#include <algorithm>
#include <cmath>

namespace wheelwright::commission {
namespace {

constexpr double kScalesApart = 8.0;

}  // namespace

SumSpread::SumSpread(Eigen::MatrixXd usual, double checks, double risk)
    : usual_(std::move(usual)),
      limit_(2.0 * kScalesApart * checks * std::log(static_cast<double>(usual_.size()) / risk)),
      sum_(Eigen::MatrixXd::Zero(usual_.rows(), usual_.cols())) {}

void SumSpread::add(const detector::SumState& look, const Eigen::MatrixXd& variances) {
  const auto w = static_cast<Eigen::Index>(look.weight), s = static_cast<Eigen::Index>(look.scale);
  const double V = variances(w, s), V0 = usual_(w, s);
  if (V0 > 0.0) {
    const double left = std::max(0.0, std::abs(look.value) - (look.threshold - look.averaged));
    sum_(w, s) += left * left / (V + V0) - std::log1p(V / V0);
  }
}

std::pair<double, std::size_t> SumSpread::largest() const {
  Eigen::Index w = 0, s = 0;
  const double most = sum_.maxCoeff(&w, &s);
  return {most / limit_, static_cast<std::size_t>(s)};
}

}  // namespace wheelwright::commission
