// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/zonotope.hpp>
#include <wheelwright/core/limits.hpp>

#include <cmath>
#include <limits>

namespace wheelwright {
namespace {

Zonotope::Block whole(const Eigen::VectorXd& centre, const Eigen::MatrixXd& generators) {
  Zonotope::Block block{{}, centre, generators, Eigen::VectorXd::Zero(centre.size())};
  for (std::size_t j = 0; j < static_cast<std::size_t>(centre.size()); ++j) {
    block.parameters.push_back(j);
  }
  return block;
}

}  // namespace

Zonotope::Zonotope(const Eigen::VectorXd& centre, const Eigen::MatrixXd& generators)
    : Zonotope(std::vector<Block>{whole(centre, generators)}) {}

Zonotope::Zonotope(std::vector<Block> blocks) : blocks_(std::move(blocks)) {
  std::size_t p = 0;
  for (const Block& block : blocks_) {
    p += block.parameters.size();
  }
  std::vector<bool> seen(p, false);
  centre_.resize(p);
  for (const Block& block : blocks_) {
    const auto q = static_cast<Eigen::Index>(block.parameters.size());
    check::that(block.centre.size() == q && block.generators.rows() == q && block.radius.size() == q, "zonotope",
                "q entries of centre and radius, and q rows of generators");
    check::that(block.centre.allFinite() && block.generators.allFinite() && block.radius.allFinite(), "zonotope",
                "finite numbers");
    check::that((block.radius.array() >= 0.0).all(), "radius of a zonotope", "numbers >= 0");
    for (Eigen::Index k = 0; k < q; ++k) {
      const std::size_t j = block.parameters[static_cast<std::size_t>(k)];
      check::that(j < p && !seen[j], "parameters of a zonotope", "0 to p - 1, each once");
      seen[j] = true;
      centre_[j] = block.centre[k];
    }
  }
}

std::size_t Zonotope::generator_count() const noexcept {
  std::size_t count = 0;
  for (const Block& block : blocks_) {
    count += static_cast<std::size_t>(block.generators.cols());
  }
  return count;
}

double Zonotope::support(std::span<const double> a) const noexcept { return support(a, std::span<double>{}); }

double Zonotope::support(std::span<const double> a, std::span<double> maximiser) const noexcept {
  double sum = 0.0, magnitude = 0.0, terms = 0.0;
  for (const Block& block : blocks_) {
    const auto q = static_cast<Eigen::Index>(block.parameters.size());
    const auto index = [&](Eigen::Index k) { return block.parameters[static_cast<std::size_t>(k)]; };
    bool any = false;
    for (Eigen::Index k = 0; k < q; ++k) {
      const double x = a[index(k)], along = x * block.centre[k], across = std::abs(x) * block.radius[k];
      any = any || x != 0.0;
      sum += along + across;
      magnitude += std::abs(along) + across;
      if (!maximiser.empty()) {
        maximiser[index(k)] = block.centre[k] + std::copysign(block.radius[k], x);
      }
    }
    if (!any) {
      continue;
    }
    for (Eigen::Index i = 0; i < block.generators.cols(); ++i) {
      const double* generator = block.generators.data() + i * q;
      double product = 0.0;
      for (Eigen::Index k = 0; k < q; ++k) {
        const double term = a[index(k)] * generator[k];
        product += term;
        magnitude += std::abs(term);
      }
      sum += std::abs(product);
      for (Eigen::Index k = 0; k < q && !maximiser.empty(); ++k) {
        maximiser[index(k)] += product < 0.0 ? -generator[k] : generator[k];
      }
    }
    terms += static_cast<double>(block.generators.cols() + 3 * q);
  }
  if (terms == 0.0) {
    return 0.0;
  }
  // Each number passes through at most q + 1 roundings in its product and one per later sum, fewer than `terms` + 3 in
  // all, of half an epsilon each and relative to the sum of magnitudes (Higham 2002, section 3.1); each product may
  // underflow. Twice that covers the rounding of the bound itself.
  return round_up(sum + ((terms + 3.0) * kEpsilon * magnitude +
                         (terms + 1.0) * (terms + 1.0) * std::numeric_limits<double>::denorm_min()));
}

bool Zonotope::contains(std::span<const double> theta) const noexcept {
  std::vector<double> direction(dimension(), 0.0);
  const double gamma = 4.0 * (static_cast<double>(dimension()) + 2.0) * kEpsilon;
  // Whether `direction` proves that θ lies outside.
  const auto separates = [&] {
    double product = 0.0, magnitude = std::numeric_limits<double>::min();
    for (std::size_t j = 0; j < direction.size(); ++j) {
      product += direction[j] * theta[j];
      magnitude += std::abs(direction[j] * theta[j]);
    }
    return !(product - gamma * magnitude <= support(direction));
  };
  for (const Block& block : blocks_) {
    const auto q = static_cast<Eigen::Index>(block.parameters.size());
    const auto entry = [&](Eigen::Index k) -> double& {
      return direction[block.parameters[static_cast<std::size_t>(k)]];
    };
    Eigen::VectorXd rest(q), half = block.generators.cwiseAbs().rowwise().sum() + block.radius;
    for (Eigen::Index k = 0; k < q; ++k) {
      for (const double sign : {1.0, -1.0}) {
        entry(k) = sign;
        if (separates()) {
          return false;
        }
      }
      entry(k) = 0.0;
      half[k] = std::max(half[k], std::numeric_limits<double>::min());
      rest[k] = (theta[block.parameters[static_cast<std::size_t>(k)]] - block.centre[k]) / half[k];
    }
    const Eigen::MatrixXd scaled = half.cwiseInverse().asDiagonal() * block.generators;
    const Eigen::VectorXd squares = scaled.colwise().squaredNorm();
    Eigen::VectorXd xi = Eigen::VectorXd::Zero(scaled.cols());
    for (int sweep = 1; sweep <= 512 && rest.norm() > 1e-10; ++sweep) {
      for (Eigen::Index i = 0; i < scaled.cols(); ++i) {
        if (squares[i] > 0.0) {
          const double next = std::clamp(xi[i] + scaled.col(i).dot(rest) / squares[i], -1.0, 1.0);
          rest -= (next - xi[i]) * scaled.col(i);
          xi[i] = next;
        }
      }
      if ((sweep & (sweep - 1)) == 0) {
        for (Eigen::Index k = 0; k < q; ++k) {
          entry(k) = rest[k] / half[k];
        }
        if (separates()) {
          return false;
        }
      }
    }
    for (Eigen::Index k = 0; k < q; ++k) {
      entry(k) = 0.0;
    }
  }
  return true;
}

}  // namespace wheelwright
