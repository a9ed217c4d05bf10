// SPDX-License-Identifier: Apache-2.0
#include "identify/moments.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "identify/gram_kernels.hpp"

namespace wheelwright::identify {

BlockSums::BlockSums(std::size_t dimension, std::size_t kept) : capacity_(2 * kept) {
  check::that(dimension > 0, "BlockSums dimension", "at least 1");
  check::that(kept >= 8, "BlockSums kept", "at least 8");
  sums_ = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(dimension), static_cast<Eigen::Index>(capacity_));
  current_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(dimension));
}

void BlockSums::add(const Eigen::Ref<const Eigen::VectorXd>& value) {
  current_ += value;
  ++count_;
  if (++in_current_ < length_) {
    return;
  }
  sums_.col(static_cast<Eigen::Index>(full_++)) = current_;
  current_.setZero();
  in_current_ = 0;
  if (full_ == capacity_) {
    for (std::size_t k = 0; k < capacity_ / 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      sums_.col(at) = (sums_.col(2 * at) + sums_.col(2 * at + 1)).eval();
    }
    full_ = capacity_ / 2;
    length_ *= 2;
  }
}

namespace {

double cosine(std::size_t frequency, Eigen::Index block, Eigen::Index blocks) {
  const double phase = std::numbers::pi * static_cast<double>(frequency) * (static_cast<double>(block) + 0.5) /
                       static_cast<double>(blocks);
  return std::numbers::sqrt2 * std::cos(phase);
}

}  // namespace

LongRunCovariance long_run_covariance(const Eigen::MatrixXd& block_sums, std::size_t most_frequencies) {
  const auto blocks = block_sums.cols();
  LongRunCovariance result;
  result.matrix = Eigen::MatrixXd::Zero(block_sums.rows(), block_sums.rows());
  if (blocks < 2) {
    return result;
  }
  const auto rule = static_cast<std::size_t>(0.4 * std::pow(static_cast<double>(blocks), 2.0 / 3.0));
  const auto frequencies =
      std::min<std::size_t>(std::clamp<std::size_t>(rule, 4, std::max<std::size_t>(most_frequencies, 4)),
                            static_cast<std::size_t>(blocks - 1));
  for (std::size_t f = 1; f <= frequencies; ++f) {
    Eigen::VectorXd projection = Eigen::VectorXd::Zero(block_sums.rows());
    for (Eigen::Index k = 0; k < blocks; ++k) {
      projection += cosine(f, k, blocks) * block_sums.col(k);
    }
    result.matrix += projection * projection.transpose();
  }
  result.matrix /= static_cast<double>(frequencies);
  result.freedom = static_cast<double>(frequencies);
  return result;
}

LongRunCovariance long_run_covariance(const BlockSums& series, std::size_t most_frequencies) {
  const Eigen::MatrixXd sums = series.blocks();
  LongRunCovariance result = long_run_covariance(sums, most_frequencies);
  if (sums.cols() >= 2) {
    // The full blocks' share of the series; the values after them are allowed for in ratio.
    const double covered = static_cast<double>(sums.cols()) * static_cast<double>(series.block_length());
    result.matrix *= static_cast<double>(series.count()) / covered;
  }
  return result;
}

double effective_freedom(const Eigen::RowVectorXd& squares, std::size_t frequencies) {
  const Eigen::Index blocks = squares.size();
  if (blocks < 2) {
    return 0.0;
  }
  frequencies = std::min(frequencies, static_cast<std::size_t>(blocks - 1));
  Eigen::MatrixXd M =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(frequencies), static_cast<Eigen::Index>(frequencies));
  Eigen::VectorXd cosines(M.rows());
  for (Eigen::Index k = 0; k < blocks; ++k) {
    for (std::size_t f = 0; f < frequencies; ++f) {
      cosines[static_cast<Eigen::Index>(f)] = cosine(f + 1, k, blocks);
    }
    M += squares[k] * cosines * cosines.transpose();
  }
  const double trace = M.trace();
  return trace > 0.0 ? trace * trace / M.squaredNorm() : 0.0;
}

namespace {

constexpr std::size_t kTile = 256;  // rows packed at a time
constexpr std::size_t kLanes = 8;   // of Σ y², so that every processor adds in the same order

}  // namespace

RegressionMoments::RegressionMoments(std::size_t outputs, std::size_t parameters, bool instruments, std::size_t kept)
    : n_(outputs),
      p_(parameters),
      columns_((parameters + gram_kernels::kGroup - 1) / gram_kernels::kGroup * gram_kernels::kGroup),
      instruments_(instruments),
      capacity_(2 * kept),
      size_(p_ * columns_ + columns_ + kLanes) {
  check::that(outputs > 0, "outputs", "at least 1");
  check::that(parameters > 0, "parameters", "at least 1");
  check::that(kept >= 8, "RegressionMoments kept", "at least 8");
  if (instruments) {
    size_ += 2 * p_ * columns_ + columns_;
  }
  Y_.assign(kTile * columns_, 0.0);
  Z_.assign(instruments ? kTile * columns_ : 0, 0.0);
}

gram_kernels::Matrix RegressionMoments::packed(const core::RowMatrix& from, std::size_t column, std::size_t first,
                                               std::size_t count, std::vector<double>& tile) const {
  const auto width = static_cast<std::size_t>(from.cols());
  const double* source = from.data() + first * width + column;
  if (p_ == columns_) {
    return {source, n_ * width};
  }
  for (std::size_t k = 0; k < count; ++k) {
    std::copy_n(source + k * n_ * width, p_, tile.data() + k * columns_);
  }
  return {tile.data(), columns_};
}

void RegressionMoments::open_block(double t) {
  if (blocks_.size() == capacity_) {
    for (std::size_t b = 0; b < capacity_ / 2; ++b) {
      const MomentBlock& left = blocks_[2 * b];
      const MomentBlock& right = blocks_[2 * b + 1];
      blocks_[b] = {left.first, right.last, left.instants + right.instants};
      const double* from = sums(2 * b, 0);
      double* to = sums(b, 0);
      const std::size_t count = n_ * size_;
      for (std::size_t k = 0; k < count; ++k) {
        to[k] = from[k] + from[count + k];
      }
    }
    blocks_.resize(capacity_ / 2);
    data_.resize(blocks_.size() * n_ * size_);
    length_ *= 2;
  }
  blocks_.push_back({t, t, 0});
  data_.resize(blocks_.size() * n_ * size_, 0.0);
}

void RegressionMoments::add(const RegressionBlock& rows) {
  check::that(rows.outputs == n_ && rows.parameters == (instruments_ ? 2 * p_ : p_), "moments",
              "rows of the announced shape");
  const gram_kernels::GramKernels& kernels = gram_kernels::best();
  const std::size_t square = p_ * columns_;
  for (std::size_t k = 0; k < rows.instants();) {
    if (blocks_.empty() || blocks_.back().instants == length_) {
      open_block(rows.t[k]);
    }
    MomentBlock& block = blocks_.back();
    const std::size_t count = std::min({length_ - block.instants, rows.instants() - k, kTile});
    for (std::size_t i = 0; i < n_; ++i) {
      double* YY = sums(blocks_.size() - 1, i);
      double* yy = YY + square + columns_;
      const gram_kernels::Matrix y{rows.y.data() + k * n_ + i, n_};
      const gram_kernels::Matrix Y = packed(rows.Y, 0, k * n_ + i, count, Y_);
      for (std::size_t r = 0; r < count; ++r) {
        yy[(block.instants + r) % kLanes] += y.data[r * n_] * y.data[r * n_];
      }
      kernels.products(Y, p_, Y, columns_, y, count, true, YY);
      if (instruments_) {
        double* ZY = yy + kLanes;
        const gram_kernels::Matrix Z = packed(rows.Y, p_, k * n_ + i, count, Z_);
        kernels.products(Z, p_, Y, columns_, {}, count, false, ZY);
        kernels.products(Z, p_, Z, columns_, y, count, true, ZY + square);
      }
    }
    block.instants += count;
    k += count;
    block.last = rows.t[k - 1];
  }
  instants_ += rows.instants();
}

MomentSums RegressionMoments::nothing() const {
  const auto p = static_cast<Eigen::Index>(p_);
  MomentSums s;
  s.YY = Eigen::MatrixXd::Zero(p, p);
  s.Yy = Eigen::VectorXd::Zero(p);
  if (instruments_) {
    s.ZY = s.ZZ = s.YY;
    s.Zy = s.Yy;
  }
  return s;
}

void RegressionMoments::add_to(MomentSums& into, const double* sums, double factor) const {
  const auto p = static_cast<Eigen::Index>(p_);
  const Eigen::OuterStride<> stride(static_cast<Eigen::Index>(columns_));
  using Square = Eigen::Map<const core::RowMatrix, 0, Eigen::OuterStride<>>;
  using Column = Eigen::Map<const Eigen::VectorXd>;
  const std::size_t square = p_ * columns_;
  const auto symmetric = [&](const double* from) {
    return core::RowMatrix(Square(from, p, p, stride).selfadjointView<Eigen::Upper>());
  };
  into.YY += factor * symmetric(sums);
  into.Yy += factor * Column(sums + square, p);
  const double* yy = sums + square + columns_;
  into.yy += factor * Column(yy, static_cast<Eigen::Index>(kLanes)).sum();
  if (instruments_) {
    const double* ZY = yy + kLanes;
    into.ZY += factor * Square(ZY, p, p, stride);
    into.ZZ += factor * symmetric(ZY + square);
    into.Zy += factor * Column(ZY + 2 * square, p);
  }
}

MomentSums RegressionMoments::block(std::size_t b, const Eigen::VectorXd& weights) const {
  check::that(b < blocks_.size(), "moment block", "one of those there are");
  check::that(static_cast<std::size_t>(weights.size()) == n_, "weights", "one for each output");
  MomentSums s = nothing();
  for (std::size_t i = 0; i < n_; ++i) {
    const double w = weights[static_cast<Eigen::Index>(i)];
    add_to(s, sums(b, i), w * w);
  }
  return s;
}

MomentSums RegressionMoments::total(const Eigen::VectorXd& weights) const {
  check::that(static_cast<std::size_t>(weights.size()) == n_, "weights", "one for each output");
  MomentSums s = nothing();
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    for (std::size_t i = 0; i < n_; ++i) {
      const double w = weights[static_cast<Eigen::Index>(i)];
      add_to(s, sums(b, i), w * w);
    }
  }
  return s;
}

MomentSums RegressionMoments::of_output(std::size_t i) const {
  check::that(i < n_, "output", "one of those there are");
  return total(Eigen::VectorXd::Unit(static_cast<Eigen::Index>(n_), static_cast<Eigen::Index>(i)));
}

namespace {

RegressionMoments walk(core::RegressionSource& rows, RegressionMoments sums) {
  core::for_each_block(rows, [&](const RegressionBlock& block) { sums.add(block); });
  return sums;
}

}  // namespace

RegressionMoments moments(core::RegressionSource& rows) {
  return walk(rows, RegressionMoments(rows.outputs(), rows.parameters()));
}

RegressionMoments moments_with_instruments(core::RegressionSource& rows) {
  check::that(rows.parameters() % 2 == 0, "rows with instruments", "as many columns of Z as of Y");
  return walk(rows, RegressionMoments(rows.outputs(), rows.parameters() / 2, true));
}

Eigen::VectorXd efficient_weights(const RegressionMoments& moments) {
  Eigen::VectorXd weights(static_cast<Eigen::Index>(moments.outputs()));
  const double instants = std::max(1.0, static_cast<double>(moments.instants()));
  for (std::size_t i = 0; i < moments.outputs(); ++i) {
    const MomentSums s = moments.of_output(i);
    const Eigen::VectorXd theta = core::minimum_norm_solution(s.YY, s.Yy);
    const double rms = std::sqrt(std::max(0.0, s.yy - s.Yy.dot(theta)) / instants);
    const double scale = std::sqrt(s.yy / instants);
    // A perfect fit has no scale of its own.
    weights[static_cast<Eigen::Index>(i)] = scale > 0.0 ? 1.0 / std::max(rms, 1e-7 * scale) : 1.0;
  }
  return weights;
}

}  // namespace wheelwright::identify
