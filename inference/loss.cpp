// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/loss.hpp>

#include <cmath>
#include <limits>

namespace wheelwright {

double tuning_constant(Loss loss) {
  switch (loss) {
    case Loss::huber: return 1.345;
    case Loss::cauchy: return 2.385;
    case Loss::tukey: return 4.685;
    case Loss::squared: break;
  }
  return 1.0;
}

double LossFunction::rho(double u) const {
  const double value = root(u).value;
  return 0.5 * value * value;
}

double LossFunction::psi(double u) const { return u * weight(u); }

double LossFunction::psi_slope(double u) const {
  const double q = (u / c) * (u / c);
  switch (loss) {
    case Loss::huber: return q <= 1.0 ? 1.0 : 0.0;
    case Loss::cauchy: return (1.0 - q) / ((1.0 + q) * (1.0 + q));
    case Loss::tukey: return q < 1.0 ? (1.0 - q) * (1.0 - 5.0 * q) : 0.0;
    case Loss::squared: break;
  }
  return 1.0;
}

double LossFunction::weight(double u) const {
  const double q = (u / c) * (u / c);
  switch (loss) {
    case Loss::huber: return q <= 1.0 ? 1.0 : c / std::abs(u);
    case Loss::cauchy: return 1.0 / (1.0 + q);
    case Loss::tukey: return q < 1.0 ? (1.0 - q) * (1.0 - q) : 0.0;
    case Loss::squared: break;
  }
  return 1.0;
}

double LossFunction::half_weight() const {
  switch (loss) {
    case Loss::huber: return 2.0 * c;
    case Loss::cauchy: return c;
    case Loss::tukey: return c * std::sqrt(1.0 - std::sqrt(0.5));
    case Loss::squared: break;
  }
  return std::numeric_limits<double>::infinity();
}

LossFunction::Root LossFunction::root(double u) const {
  const double q = (u / c) * (u / c);
  Root r{u, 1.0};
  if (loss == Loss::huber && q > 1.0) {
    const double size = std::sqrt(c * (2.0 * std::abs(u) - c));
    r = {std::copysign(size, u), c / size};
  } else if (loss == Loss::cauchy && q > 0.0) {
    r.value = std::copysign(c * std::sqrt(std::log1p(q)), u);
    r.slope = u / (r.value * (1.0 + q));
  } else if (loss == Loss::tukey && q < 1.0) {
    const double share = std::sqrt(1.0 - q + q * q / 3.0);
    r = {u * share, (1.0 - q) * (1.0 - q) / share};
  } else if (loss == Loss::tukey) {
    r = {std::copysign(c / std::sqrt(3.0), u), 0.0};
  }
  return r;
}

}  // namespace wheelwright
