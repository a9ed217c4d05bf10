// SPDX-License-Identifier: Apache-2.0
#include "bounds/survey.hpp"

#include <algorithm>
#include <numeric>

#include "bounds/box.hpp"

namespace wheelwright::bounds {
namespace {

constexpr std::size_t kRun = 8;
constexpr std::size_t kRuns = 2048;
constexpr Eigen::Index kMany = 512;  // rows of a product

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
  memory_ = std::make_unique_for_overwrite<double[]>(n * columns);
  const auto gather = [&](std::size_t column, const double* from) {
    for (std::size_t i = 0; i < n; ++i) {
      memory_[column * n + i] = from[picked[i]];
    }
  };
  SlabColumns all = rows;
  all.n = n;
  for (std::size_t j = 0; j < p; ++j) {
    gather(j, rows.Y[j]);
    all.Y[j] = memory_.get() + j * n;
  }
  for (std::size_t j = 0; j < rows.dY.size(); ++j) {
    gather(p + j, rows.dY[j]);
    all.dY[j] = memory_.get() + (p + j) * n;
  }
  gather(columns - 2, rows.y);
  gather(columns - 1, rows.dy);
  all.y = memory_.get() + (columns - 2) * n;
  all.dy = memory_.get() + (columns - 1) * n;
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
  const Eigen::VectorXd reach = prior.magnitudes();
  const Eigen::Map<const Eigen::MatrixXd> Y(memory_.get(), n, p);
  Eigen::VectorXd width = Eigen::Map<const Eigen::VectorXd>(rows.dy, n);
  for (std::size_t j = 0; j < rows.dY.size(); ++j) {
    width += Eigen::Map<const Eigen::VectorXd>(rows.dY[j], n) * reach[static_cast<Eigen::Index>(j)];
  }
  return width.cwiseMax(1e-9 * (Y.cwiseAbs() * reach)).cwiseMax(1e-150).cwiseInverse();
}

Eigen::MatrixXd SpreadSample::information(const Box& prior) const {
  const auto p = static_cast<Eigen::Index>(all().parameters());
  const auto n = static_cast<Eigen::Index>(all().n);
  const Eigen::Map<const Eigen::MatrixXd> Y(memory_.get(), n, p);
  const Eigen::VectorXd weight = weights(prior);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(p, p), some;
  for (Eigen::Index first = 0; first < n; first += kMany) {
    const Eigen::Index count = std::min<Eigen::Index>(kMany, n - first);
    some = weight.segment(first, count).asDiagonal() * Y.middleRows(first, count);
    sum.noalias() += some.transpose() * some;
  }
  return sum;
}

Eigen::VectorXd SpreadSample::estimate(const Box& prior, const Eigen::MatrixXd& information) const {
  const auto p = static_cast<Eigen::Index>(all().parameters());
  const auto n = static_cast<Eigen::Index>(all().n);
  const Eigen::Map<const Eigen::MatrixXd> Y(memory_.get(), n, p);
  const Eigen::VectorXd weight = weights(prior).cwiseAbs2();
  const Coordinates at = whitened(prior, information);
  const Eigen::VectorXd rest = Eigen::Map<const Eigen::VectorXd>(all().y, n) - Y * at.centre;
  return at.centre + at.transform * (at.transform.transpose() * (Y.transpose() * weight.cwiseProduct(rest)));
}

bool SpreadSample::each_level(const std::function<bool(const SlabColumns&)>& take) const {
  return std::all_of(levels_.begin(), levels_.end(), take);
}

namespace {

constexpr std::size_t kSample = 1024;

/// Keeps every stride-th instant, with the stride doubled each time the sample is full.
class EvenSample {
 public:
  EvenSample(std::size_t outputs, std::size_t parameters) { block_.resize(kSample, outputs, parameters); }

  void offer(const RegressionBlock& block, std::size_t k) {
    if (seen_++ % stride_ != 0) {
      return;
    }
    if (count_ == kSample) {
      for (std::size_t i = 0; i < kSample / 2; ++i) {
        copy(block_, 2 * i, i);
      }
      count_ = kSample / 2;
      stride_ *= 2;
      if ((seen_ - 1) % stride_ != 0) {
        return;
      }
    }
    copy(block, k, count_++);
  }

  [[nodiscard]] RegressionBlock take() {
    RegressionBlock result;
    result.resize(count_, block_.outputs, block_.parameters);
    std::swap(result, block_);
    for (std::size_t i = 0; i < count_; ++i) {
      copy(result, i, i);
    }
    return std::move(block_);
  }

 private:
  void copy(const RegressionBlock& from, std::size_t k, std::size_t to) {
    const auto n = static_cast<Eigen::Index>(block_.outputs);
    const auto source = static_cast<Eigen::Index>(k) * n, target = static_cast<Eigen::Index>(to) * n;
    block_.sample[to] = from.sample[k];
    block_.t[to] = from.t[k];
    for (Eigen::Index i = 0; i < n; ++i) {
      block_.Y.row(target + i) = from.Y.row(source + i);
      block_.dY.row(target + i) = from.dY.row(source + i);
      block_.y[target + i] = from.y[source + i];
      block_.dy[target + i] = from.dy[source + i];
    }
  }

  RegressionBlock block_;
  std::size_t count_ = 0, stride_ = 1, seen_ = 0;
};

/// Disjoint sets of parameters.
class Groups {
 public:
  explicit Groups(std::size_t p) : leader_(p) { std::iota(leader_.begin(), leader_.end(), std::size_t{0}); }
  std::size_t find(std::size_t j) const {
    while (leader_[j] != j) {
      j = leader_[j];
    }
    return j;
  }
  void join(std::size_t i, std::size_t j) {
    const std::size_t x = find(i), y = find(j);
    leader_[std::max(x, y)] = std::min(x, y);
  }
  std::vector<std::vector<std::size_t>> list() const {
    std::vector<std::vector<std::size_t>> groups(leader_.size());
    for (std::size_t j = 0; j < leader_.size(); ++j) {
      groups[find(j)].push_back(j);
    }
    std::erase_if(groups, [](const auto& group) { return group.empty(); });
    return groups;
  }

 private:
  std::vector<std::size_t> leader_;
};

}  // namespace

RowSurvey survey(core::RegressionSource& source, const Box& prior, const std::vector<std::size_t>& excluded) {
  const std::size_t p = prior.dimension();
  check::that(p > 0 && source.parameters() == p, "prior box", "one side per parameter of the regression");
  check_finite(prior, "prior box");
  check::that(source.outputs() > 0, "regression", "at least one output");
  const auto cols = static_cast<Eigen::Index>(p);
  RowSurvey result;
  result.noisy.assign(p, false);
  result.information = Eigen::MatrixXd::Zero(cols, cols);
  result.moment = Eigen::VectorXd::Zero(cols);
  const Eigen::VectorXd reach = prior.magnitudes();
  Groups groups(p);
  EvenSample sample(source.outputs(), p);
  std::vector<Eigen::Index> support;
  core::for_each_block(source, [&](const RegressionBlock& block) {
    check::that(block.parameters == p && block.outputs == source.outputs(), "regression block", "the source's shape");
    for (std::size_t k = 0; k < block.instants(); ++k) {
      if (std::binary_search(excluded.begin(), excluded.end(), block.sample[k])) {
        continue;
      }
      sample.offer(block, k);
      ++result.instants;
      for (std::size_t i = 0; i < block.outputs; ++i) {
        const auto row = static_cast<Eigen::Index>(k * block.outputs + i);
        const double* Y = block.Y.data() + row * cols;
        const double* dY = block.dY.data() + row * cols;
        ++result.rows;
        support.clear();
        double width = block.dy[row], size = std::abs(block.y[row]), sum = block.y[row] + block.dy[row];
        bool negative = block.dy[row] < 0.0;
        for (Eigen::Index j = 0; j < cols; ++j) {
          if (Y[j] != 0.0 || dY[j] != 0.0) {
            support.push_back(j);
            width += dY[j] * reach[j];
            size += std::abs(Y[j]) * reach[j];
            sum += Y[j] + dY[j];
            negative = negative || dY[j] < 0.0;
            if (dY[j] != 0.0) {
              result.noisy[static_cast<std::size_t>(j)] = true;
            }
          }
        }
        check::that(!negative && std::isfinite(sum), "regression row", "finite numbers and error bounds >= 0");
        const double weight = 1.0 / std::max({width, 1e-9 * size, 1e-150});
        for (std::size_t u = 0; u < support.size(); ++u) {
          const Eigen::Index ju = support[u];
          if (u > 0) {
            groups.join(static_cast<std::size_t>(support.front()), static_cast<std::size_t>(ju));
          }
          const double scaled = Y[ju] * weight;
          result.moment[ju] += scaled * (block.y[row] * weight);
          for (std::size_t v = 0; v <= u; ++v) {
            result.information(ju, support[v]) += scaled * (Y[support[v]] * weight);
          }
        }
      }
    }
  });
  result.information = result.information.selfadjointView<Eigen::Lower>();
  result.blocks = groups.list();
  result.sample = sample.take();
  return result;
}

Eigen::VectorXd weighted_estimate(const RowSurvey& survey, const Box& prior) {
  const Coordinates at = whitened(prior, survey.information);
  const Eigen::VectorXd pull = at.transform.transpose() * (survey.moment - survey.information * at.centre);
  return at.centre + at.transform * pull;
}

std::vector<std::size_t> open_signs(const RowSurvey& survey, const Box& box) {
  std::vector<std::size_t> open;
  for (std::size_t j = 0; j < box.dimension(); ++j) {
    if (survey.noisy[j] && box.sides[j].lower < 0.0 && box.sides[j].upper > 0.0) {
      open.push_back(j);
    }
  }
  return open;
}

}  // namespace wheelwright::bounds
