// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/vertex_ellipsoid.hpp>

#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <wheelwright/bounds/approximate_inverse.hpp>

namespace wheelwright {
namespace {

/// Least factor by which one step may change det M: a point that spans a direction alone is not dropped at once.
constexpr double kLeastWeightFactor = 0.1;

/// Weights u >= 0 of lifted points x = (z, 1) that maximise log det M − Σ u, M = Σ u x xᵀ. At the optimum xᵀM⁻¹x <= 1
/// for all points, and Σ u = q + 1; elsewhere Σ u · max xᵀM⁻¹x is larger than that.
class PointDesign {
 public:
  explicit PointDesign(const Eigen::MatrixXd& z) : x_(z.rows() + 1, z.cols()), u_(Eigen::VectorXd::Zero(z.cols())) {
    x_ << z, Eigen::RowVectorXd::Ones(z.cols());
  }

  bool maximise(double tolerance, std::size_t cycles) {
    start();
    for (std::size_t round = 0; round < cycles; ++round) {
      if (!refresh()) {
        return false;
      }
      const Eigen::VectorXd sizes = x_.cwiseProduct(inverse_ * x_).colwise().sum();
      if (u_.sum() * sizes.maxCoeff() <= static_cast<double>(x_.rows()) * (1.0 + tolerance)) {
        return true;
      }
      widen(sizes);
      for (int cycle = 0; cycle < 20; ++cycle) {
        for (const Eigen::Index i : working_) {
          step(i);
        }
      }
      std::erase_if(working_, [&](Eigen::Index i) { return u_[i] == 0.0; });
    }
    return refresh();
  }

  /// The ellipsoid of the weights: (z − centre)ᵀS⁻¹(z − centre) <= q with S the weighted covariance.
  [[nodiscard]] std::optional<VertexEllipsoid> ellipsoid() const {
    const Eigen::Index q = x_.rows() - 1;
    const Eigen::VectorXd share = u_ / u_.sum();
    const Eigen::VectorXd centre = x_.topRows(q) * share;
    const Eigen::MatrixXd offsets = x_.topRows(q).colwise() - centre;
    const Eigen::LLT<Eigen::MatrixXd> factor(static_cast<double>(q) * offsets * share.asDiagonal() *
                                             offsets.transpose());
    return factor.info() == Eigen::Success ? std::optional(VertexEllipsoid{centre, factor.matrixL()}) : std::nullopt;
  }

 private:
  /// Starts with the extreme points of each coordinate.
  void start() {
    for (Eigen::Index k = 0; k + 1 < x_.rows(); ++k) {
      Eigen::Index low = 0, high = 0;
      x_.row(k).minCoeff(&low);
      x_.row(k).maxCoeff(&high);
      u_[low] = u_[high] = 1.0;
    }
    for (Eigen::Index i = 0; i < u_.size(); ++i) {
      if (u_[i] > 0.0) {
        working_.push_back(i);
      }
    }
    // Where those do not span the space: all points.
    if (const Eigen::FullPivLU<Eigen::MatrixXd> rank(x_ * u_.asDiagonal() * x_.transpose()); !rank.isInvertible()) {
      u_.setOnes();
      working_.resize(static_cast<std::size_t>(u_.size()));
      for (Eigen::Index i = 0; i < u_.size(); ++i) {
        working_[static_cast<std::size_t>(i)] = i;
      }
    }
  }

  /// Takes the points into the working set that lie farthest out, one more than there are parameters.
  void widen(const Eigen::VectorXd& sizes) {
    std::vector<Eigen::Index> outside;
    for (Eigen::Index i = 0; i < sizes.size(); ++i) {
      if (sizes[i] > 1.0 && u_[i] == 0.0) {
        outside.push_back(i);
      }
    }
    const std::size_t count = std::min(outside.size(), static_cast<std::size_t>(x_.rows()));
    std::partial_sort(outside.begin(), outside.begin() + static_cast<std::ptrdiff_t>(count), outside.end(),
                      [&](Eigen::Index i, Eigen::Index j) { return sizes[i] > sizes[j]; });
    working_.insert(working_.end(), outside.begin(), outside.begin() + static_cast<std::ptrdiff_t>(count));
  }

  bool refresh() {
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(x_.rows(), x_.rows());
    for (const Eigen::Index i : working_) {
      m += u_[i] * x_.col(i) * x_.col(i).transpose();
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(m);
    inverse_ = factor.solve(Eigen::MatrixXd::Identity(m.rows(), m.cols()));
    return factor.info() == Eigen::Success && inverse_.allFinite();
  }

  /// Exact maximisation over u_i: with u_i + t and v = xᵀM⁻¹x, log(1 + tv) − t has its maximum where 1 + tv = v.
  void step(Eigen::Index i) {
    const Eigen::VectorXd w = inverse_ * x_.col(i);
    const double v = x_.col(i).dot(w), best = std::max(v, kLeastWeightFactor), zero = 1.0 - u_[i] * v;
    if (!(v > 0.0)) {
      return;
    }
    const double t = best > zero ? (best - 1.0) / v : -u_[i], factor = std::max(best, zero);
    if (std::isfinite(t) && t != 0.0) {
      u_[i] = best > zero ? u_[i] + t : 0.0;
      inverse_ -= (t / factor) * w * w.transpose();
    }
  }

  Eigen::MatrixXd x_;
  Eigen::VectorXd u_;
  std::vector<Eigen::Index> working_;
  Eigen::MatrixXd inverse_;
};

/// A bound of |shape⁻¹(v − centre)| over all exact vertices v; nothing where shape is not proved regular.
std::optional<double> certified_radius(const VertexSet& vertices, const VertexEllipsoid& ellipsoid) {
  const auto point = [](double x) { return Interval{x, x}; };
  const ApproximateInverse inverse = approximate_inverse(ellipsoid.shape);
  if (!(inverse.defect < 0.5)) {
    return std::nullopt;
  }
  const Eigen::Index q = ellipsoid.centre.size();
  double largest = 0.0;
  for (Eigen::Index v = 0; v < vertices.points.cols(); ++v) {
    double squares = 0.0;
    for (Eigen::Index i = 0; i < q; ++i) {
      Interval y = point(0.0);
      for (Eigen::Index j = 0; j < q; ++j) {
        const double at = vertices.points(j, v), radius = vertices.radius[j];
        const Interval offset = Interval{round_down(at - radius), round_up(at + radius)} - point(ellipsoid.centre[j]);
        y = y + point(inverse.inverse(i, j)) * offset;
      }
      const double size = std::max(std::abs(y.lower), std::abs(y.upper));
      squares = round_up(squares + round_up(size * size));
    }
    largest = squares > largest || !(squares >= 0.0) ? squares : largest;
  }
  return round_up(round_up(std::sqrt(largest)) / round_down(1.0 - inverse.defect));
}

}  // namespace

std::optional<VertexEllipsoid> vertex_ellipsoid(const VertexSet& vertices, const Coordinates& coordinates,
                                                double tolerance, std::size_t cycles) {
  const Eigen::PartialPivLU<Eigen::MatrixXd> transform(coordinates.transform);
  const Eigen::MatrixXd z = transform.solve(vertices.points.colwise() - coordinates.centre);
  PointDesign design(z);
  if (!z.allFinite() || !design.maximise(tolerance, cycles)) {
    return std::nullopt;
  }
  std::optional<VertexEllipsoid> result = design.ellipsoid();
  if (!result) {
    return std::nullopt;
  }
  result->centre = coordinates.centre + coordinates.transform * result->centre;
  result->shape = coordinates.transform * result->shape;
  for (int attempt = 0; attempt < 8 && result->centre.allFinite() && result->shape.allFinite(); ++attempt) {
    const std::optional<double> radius = certified_radius(vertices, *result);
    if (!radius || !std::isfinite(*radius)) {
      return std::nullopt;
    }
    if (*radius <= 1.0) {
      return result;
    }
    result->shape *= *radius * (1.0 + 1e-15);
  }
  return std::nullopt;
}

}  // namespace wheelwright
