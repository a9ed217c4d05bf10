// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/ellipsoid.hpp>
#include <wheelwright/core/limits.hpp>

#include <cmath>
#include <limits>

namespace wheelwright {

Ellipsoid::Ellipsoid(const Eigen::VectorXd& centre, const Eigen::MatrixXd& shape)
    : Ellipsoid([&] {
        Block block{{}, centre, shape};
        for (std::size_t j = 0; j < static_cast<std::size_t>(centre.size()); ++j) {
          block.parameters.push_back(j);
        }
        return std::vector<Block>{std::move(block)};
      }()) {}

Ellipsoid::Ellipsoid(std::vector<Block> blocks) : blocks_(std::move(blocks)) {
  std::size_t p = 0;
  for (const Block& block : blocks_) {
    p += block.parameters.size();
  }
  std::vector<bool> seen(p, false);
  centre_.resize(p);
  for (const Block& block : blocks_) {
    const auto q = static_cast<Eigen::Index>(block.parameters.size());
    check::that(block.centre.size() == q && block.shape.rows() == q && block.shape.cols() == q, "ellipsoid",
                "q entries of centre and q × q of shape");
    check::that(block.centre.allFinite() && block.shape.allFinite(), "ellipsoid", "finite numbers");
    Membership membership{approximate_inverse(block.shape), Eigen::VectorXd(q)};
    for (Eigen::Index k = 0; k < q; ++k) {
      const std::size_t j = block.parameters[static_cast<std::size_t>(k)];
      check::that(j < p && !seen[j], "parameters of an ellipsoid", "0 to p - 1, each once");
      seen[j] = true;
      centre_[j] = block.centre[k];
      double squares = 0.0;
      const double scale = block.shape.row(k).cwiseAbs().maxCoeff();
      for (Eigen::Index i = 0; i < q && scale > 0.0; ++i) {
        const double x = round_up(std::abs(block.shape(k, i)) / scale);
        squares = round_up(squares + round_up(x * x));
      }
      membership.half_side[k] = scale > 0.0 ? round_up(scale * round_up(std::sqrt(squares))) : 0.0;
    }
    membership_.push_back(std::move(membership));
  }
}

double Ellipsoid::support(std::span<const double> a) const noexcept { return support(a, std::span<double>{}); }

double Ellipsoid::support(std::span<const double> a, std::span<double> maximiser) const noexcept {
  double sum = 0.0, magnitude = 0.0;
  bool any = false;
  for (const Block& block : blocks_) {
    const auto q = static_cast<Eigen::Index>(block.parameters.size());
    const auto entry = [&](Eigen::Index k) { return a[block.parameters[static_cast<std::size_t>(k)]]; };
    double largest = 0.0;
    for (Eigen::Index k = 0; k < q; ++k) {
      largest = std::max(largest, std::abs(entry(k)));
      any = any || entry(k) != 0.0;
    }
    for (Eigen::Index k = 0; k < q && !maximiser.empty(); ++k) {
      maximiser[block.parameters[static_cast<std::size_t>(k)]] = block.centre[k];
    }
    if (largest == 0.0) {
      continue;
    }
    // Norms in two passes, scaled, so that no square leaves the range of doubles.
    double scale = 0.0;
    for (Eigen::Index i = 0; i < q; ++i) {
      double terms = 0.0;
      for (Eigen::Index k = 0; k < q; ++k) {
        terms += std::abs(block.shape(k, i) * entry(k));
      }
      scale = std::max(scale, terms);
    }
    double squares = 0.0, term_squares = 0.0;
    for (Eigen::Index i = 0; i < q && scale > 0.0; ++i) {
      double y = 0.0, terms = 0.0;
      for (Eigen::Index k = 0; k < q; ++k) {
        const double term = block.shape(k, i) * entry(k);
        y += term;
        terms += std::abs(term);
      }
      squares += (y / scale) * (y / scale);
      term_squares += (terms / scale) * (terms / scale);
    }
    const double norm = scale * std::sqrt(squares);
    sum += norm;
    magnitude += scale * std::sqrt(term_squares);
    for (Eigen::Index k = 0; k < q; ++k) {
      const double term = entry(k) * block.centre[k];
      sum += term;
      magnitude += std::abs(term);
    }
    for (Eigen::Index i = 0; i < q && !maximiser.empty() && norm > 0.0; ++i) {
      double y = 0.0;
      for (Eigen::Index k = 0; k < q; ++k) {
        y += block.shape(k, i) * entry(k);
      }
      for (Eigen::Index k = 0; k < q; ++k) {
        maximiser[block.parameters[static_cast<std::size_t>(k)]] += block.shape(k, i) * (y / norm);
      }
    }
  }
  if (!any) {
    return 0.0;
  }
  // Each number passes through fewer than 4p + 8 roundings of half an epsilon, each relative to the sum of the terms'
  // magnitudes (Higham 2002, section 3.1), and p² products may underflow; twice that covers the rounding of the bound
  // itself.
  const auto p = static_cast<double>(dimension());
  return round_up(
      sum + ((4.0 * p + 8.0) * kEpsilon * magnitude + (4.0 * p * p + 4.0) * std::numeric_limits<double>::denorm_min()));
}

bool Ellipsoid::contains(std::span<const double> theta) const noexcept {
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    const Membership& membership = membership_[b];
    const auto q = static_cast<Eigen::Index>(block.parameters.size());
    const auto offset = [&](Eigen::Index k) {
      return theta[block.parameters[static_cast<std::size_t>(k)]] - block.centre[k];
    };
    for (Eigen::Index k = 0; k < q; ++k) {
      if (!(std::abs(offset(k)) * (1.0 - 2.0 * kEpsilon) <= membership.half_side[k])) {
        return false;
      }
    }
    if (!(membership.shape.defect < 0.5)) {
      continue;
    }
    // W(θ − c) = (I − R)u with |R| <= defect, so |W(θ − c)| <= (1 + defect) |u|; subtracted: its own rounding.
    const double gamma = 2.0 * (static_cast<double>(q) + 3.0) * kEpsilon;
    double squares = 0.0;
    for (Eigen::Index i = 0; i < q; ++i) {
      double y = 0.0, terms = std::numeric_limits<double>::min();
      for (Eigen::Index k = 0; k < q; ++k) {
        const double term = membership.shape.inverse(i, k) * offset(k);
        y += term;
        terms += std::abs(term);
      }
      const double certain = std::max(0.0, std::abs(y) - gamma * terms);
      squares += certain * certain;
    }
    const double limit = 1.0 + membership.shape.defect;
    if (!(squares * (1.0 - gamma) <= limit * limit * (1.0 + gamma))) {
      return false;
    }
  }
  return true;
}

}  // namespace wheelwright
