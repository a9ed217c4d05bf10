// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/spread_sample.hpp>

#include <algorithm>

#include <wheelwright/bounds/coordinates.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t kRun = 8;
constexpr std::size_t kRuns = 2048;

}  // namespace

SpreadSample::SpreadSample(const SlabColumns& rows) {
  const std::size_t p = rows.parameters(), available = rows.n / kRun;
  const std::size_t runs = std::min(kRuns, available);
  // Runs in an order in which every beginning of the list is spread over all rows: the bits of the place reversed.
  std::vector<std::size_t> starts;
  std::size_t bits = 0;
  while (std::size_t{1} << bits < runs) {
    ++bits;
  }
  for (std::size_t k = 0; k < std::size_t{1} << bits; ++k) {
    std::size_t reversed = 0;
    for (std::size_t bit = 0; bit < bits; ++bit) {
      reversed |= (k >> bit & 1) << (bits - 1 - bit);
    }
    if (reversed < runs) {
      starts.push_back(reversed * available / runs * kRun);
    }
  }
  std::vector<std::size_t> picked;
  for (const std::size_t start : starts) {
    for (std::size_t i = 0; i < kRun; ++i) {
      picked.push_back(start + i);
    }
  }
  if (available <= kRuns) {
    for (std::size_t i = available * kRun; i < rows.n; ++i) {
      picked.push_back(i);
    }
  }
  const std::size_t n = picked.size(), columns = p + rows.dY.size() + 2;
  memory_.resize(n * columns);
  const auto gather = [&](std::size_t column, const double* from) {
    for (std::size_t i = 0; i < n; ++i) {
      memory_[column * n + i] = from[picked[i]];
    }
  };
  SlabColumns all = rows;
  all.n = n;
  for (std::size_t j = 0; j < p; ++j) {
    gather(j, rows.Y[j]);
    all.Y[j] = memory_.data() + j * n;
  }
  for (std::size_t j = 0; j < rows.dY.size(); ++j) {
    gather(p + j, rows.dY[j]);
    all.dY[j] = memory_.data() + (p + j) * n;
  }
  gather(columns - 2, rows.y);
  gather(columns - 1, rows.dy);
  all.y = memory_.data() + (columns - 2) * n;
  all.dy = memory_.data() + (columns - 1) * n;
  for (const std::size_t i : picked) {
    const RowOrigin origin = rows.origin(i);
    samples_.push_back(origin.sample);
    times_.push_back(origin.t);
  }
  all.sample = samples_.data();
  all.t = times_.data();
  for (const std::size_t share : {16, 4, 1}) {
    levels_.push_back(all.part(0, n / share));
  }
}

/// 1/w of every row.
Eigen::VectorXd SpreadSample::weights(const Box& prior) const {
  const SlabColumns& rows = all();
  const auto p = static_cast<Eigen::Index>(rows.parameters());
  const auto n = static_cast<Eigen::Index>(rows.n);
  Eigen::VectorXd reach(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    const Interval& side = prior.sides[static_cast<std::size_t>(j)];
    reach[j] = std::max(std::abs(side.lower), std::abs(side.upper));
  }
  const Eigen::Map<const Eigen::MatrixXd> Y(memory_.data(), n, p);
  Eigen::VectorXd width = Eigen::Map<const Eigen::VectorXd>(rows.dy, n);
  for (std::size_t j = 0; j < rows.dY.size(); ++j) {
    width += Eigen::Map<const Eigen::VectorXd>(rows.dY[j], n) * reach[static_cast<Eigen::Index>(j)];
  }
  return width.cwiseMax(1e-9 * (Y.cwiseAbs() * reach)).cwiseMax(1e-150).cwiseInverse();
}

Eigen::MatrixXd SpreadSample::information(const Box& prior) const {
  const auto p = static_cast<Eigen::Index>(all().parameters());
  const Eigen::Map<const Eigen::MatrixXd> Y(memory_.data(), static_cast<Eigen::Index>(all().n), p);
  const Eigen::MatrixXd weighted = weights(prior).asDiagonal() * Y;
  return weighted.transpose() * weighted;
}

Eigen::VectorXd SpreadSample::estimate(const Box& prior) const {
  const auto p = static_cast<Eigen::Index>(all().parameters());
  const auto n = static_cast<Eigen::Index>(all().n);
  const Eigen::Map<const Eigen::MatrixXd> Y(memory_.data(), n, p);
  const Eigen::VectorXd weight = weights(prior).cwiseAbs2();
  const Coordinates at = whitened(prior, information(prior));
  const Eigen::VectorXd rest = Eigen::Map<const Eigen::VectorXd>(all().y, n) - Y * at.centre;
  return at.centre + at.transform * (at.transform.transpose() * (Y.transpose() * weight.cwiseProduct(rest)));
}

bool SpreadSample::each_level(const std::function<bool(const SlabColumns&)>& take) const {
  return std::all_of(levels_.begin(), levels_.end(), take);
}

}  // namespace wheelwright
