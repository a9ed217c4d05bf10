// SPDX-License-Identifier: Apache-2.0
#include "bounds/interval_hull.hpp"

#include <algorithm>
#include <functional>
#include <numeric>

#include "bounds/cutter.hpp"
#include "bounds/hull_search.hpp"
#include "bounds/survey.hpp"

namespace wheelwright::bounds {
namespace {

constexpr std::size_t kInstants = 8192;

}  // namespace

SlabColumns SlabColumns::part(std::size_t first, std::size_t count) const {
  SlabColumns result = *this;
  result.n = count;
  for (const double*& column : result.Y) {
    column += first;
  }
  for (const double*& column : result.dY) {
    column += first;
  }
  result.y += first;
  result.dy += first;
  result.first_sample += first;
  result.sample = sample != nullptr ? sample + first : nullptr;
  result.t = t != nullptr ? t + first : nullptr;
  result.outputs = outputs != nullptr ? outputs + first : nullptr;
  return result;
}

void SlabStore::append(const SlabColumns& from, std::span<const std::uint32_t> numbers) {
  const auto gather = [&](const double* column, std::vector<double>& to) {
    const std::size_t before = to.size();
    to.resize(before + numbers.size());
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      to[before + k] = column[numbers[k]];
    }
  };
  const std::size_t held = size();
  Y_.resize(from.parameters());
  for (std::size_t j = 0; j < from.parameters(); ++j) {
    gather(from.Y[j], Y_[j]);
  }
  if (!from.dY.empty() && dY_.empty()) {
    dY_.assign(from.parameters(), std::vector<double>(held, 0.0));
  }
  for (std::size_t j = 0; j < dY_.size(); ++j) {
    if (from.dY.empty()) {
      dY_[j].resize(held + numbers.size(), 0.0);
    } else {
      gather(from.dY[j], dY_[j]);
    }
  }
  gather(from.y, y_);
  gather(from.dy, dy_);
  for (const std::uint32_t i : numbers) {
    const RowOrigin origin = from.origin(i);
    sample_.push_back(origin.sample);
    t_.push_back(origin.t);
    output_.push_back(origin.output);
  }
}

void SlabStore::keep(std::span<const std::uint32_t> numbers) {
  const auto pack = [&](auto& column) {
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      column[k] = column[numbers[k]];
    }
    column.resize(numbers.size());
  };
  for (auto* columns : {&Y_, &dY_}) {
    for (std::vector<double>& column : *columns) {
      pack(column);
    }
  }
  pack(y_);
  pack(dy_);
  pack(t_);
  pack(sample_);
  pack(output_);
}

SlabColumns SlabStore::view() const {
  SlabColumns result;
  result.n = size();
  for (const std::vector<double>& column : Y_) {
    result.Y.push_back(column.data());
  }
  for (const std::vector<double>& column : dY_) {
    result.dY.push_back(column.data());
  }
  result.y = y_.data();
  result.dy = dy_.data();
  result.sample = sample_.data();
  result.t = t_.data();
  result.outputs = output_.data();
  return result;
}

ColumnPacker::ColumnPacker(std::size_t outputs, std::size_t parameters)
    : outputs_(outputs),
      parameters_(parameters),
      memory_(outputs * (2 * parameters + 2) * kInstants),
      used_(outputs * parameters),
      noisy_(outputs),
      samples_(kInstants),
      times_(kInstants) {}

void ColumnPacker::append(const RegressionBlock& block, std::size_t instant) {
  const std::size_t p = parameters_;
  samples_[count_] = block.sample[instant];
  times_[count_] = block.t[instant];
  for (std::size_t i = 0; i < outputs_; ++i) {
    const std::size_t row = instant * outputs_ + i;
    double* to = memory_.data() + i * (2 * p + 2) * kInstants + count_;
    const double* Y = block.Y.data() + row * p;
    const double* dY = block.dY.data() + row * p;
    for (std::size_t j = 0; j < p; ++j) {
      to[j * kInstants] = Y[j];
      to[(p + j) * kInstants] = dY[j];
      const bool error = dY[j] != 0.0;
      noisy_[i] = static_cast<char>(noisy_[i] | static_cast<char>(error));
      used_[i * p + j] = static_cast<char>(used_[i * p + j] | static_cast<char>(Y[j] != 0.0 || error));
    }
    to[2 * p * kInstants] = block.y[static_cast<Eigen::Index>(row)];
    to[(2 * p + 1) * kInstants] = block.dy[static_cast<Eigen::Index>(row)];
  }
  ++count_;
}

bool ColumnPacker::hand_over(const Sink& sink) {
  const std::size_t p = parameters_;
  bool alive = true;
  for (std::size_t i = 0; alive && i < outputs_; ++i) {
    const double* from = memory_.data() + i * (2 * p + 2) * kInstants;
    SlabColumns columns;
    columns.n = count_;
    for (std::size_t j = 0; j < p; ++j) {
      columns.Y.push_back(from + j * kInstants);
      if (noisy_[i] != 0) {
        columns.dY.push_back(from + (p + j) * kInstants);
      }
    }
    columns.y = from + 2 * p * kInstants;
    columns.dy = from + (2 * p + 1) * kInstants;
    columns.sample = samples_.data();
    columns.t = times_.data();
    columns.output = i;
    const auto first = used_.begin() + static_cast<std::ptrdiff_t>(i * p);
    alive = sink(columns, std::vector<char>(first, first + static_cast<std::ptrdiff_t>(p)));
  }
  count_ = 0;
  std::fill(used_.begin(), used_.end(), char{0});
  std::fill(noisy_.begin(), noisy_.end(), char{0});
  return alive;
}

bool ColumnPacker::walk(core::RegressionSource& source, const std::vector<std::size_t>& excluded, const Sink& sink) {
  RegressionBlock block;
  source.rewind();
  bool alive = true;
  while (alive && source.next(block)) {
    for (std::size_t k = 0; alive && k < block.instants(); ++k) {
      if (excluded.empty() || !std::binary_search(excluded.begin(), excluded.end(), block.sample[k])) {
        append(block, k);
        alive = count_ < kInstants || hand_over(sink);
      }
    }
  }
  return (alive && count_ > 0 ? hand_over(sink) : (count_ = 0, alive));
}

bool ColumnPacker::walk(const RegressionBlock& block, const Sink& sink) {
  bool alive = true;
  for (std::size_t k = 0; alive && k < block.instants(); ++k) {
    append(block, k);
    alive = count_ < kInstants || hand_over(sink);
  }
  return alive && count_ > 0 ? hand_over(sink) : alive;
}

namespace {

constexpr std::size_t kMostPasses = 16;

void certify(std::pair<std::vector<CertifiedBound>, std::vector<CertifiedBound>> bounds, IntervalHull& result) {
  std::tie(result.lower, result.upper) = std::move(bounds);
  for (std::size_t j = 0; j < result.lower.size(); ++j) {
    const double low = result.lower[j].value, high = result.upper[j].value;
    result.hull.sides[j] = {std::min(low, high), std::max(low, high)};
  }
}

IntervalHull hull_of(Cutter& cutter, const Box& prior, const std::function<bool()>& pass) {
  IntervalHull result;
  result.hull = prior;
  bool alive = cutter.tighten();
  do {
    cutter.begin_pass();
    alive = alive && pass() && cutter.finish();
    ++result.passes;
  } while (alive && cutter.again() && result.passes < kMostPasses);
  result.candidates = cutter.candidates();
  result.empty = !alive;
  if (!alive) {
    result.contradiction = cutter.contradiction();
    return result;
  }
  certify(cutter.certified_hull(), result);
  return result;
}

}  // namespace

IntervalHull interval_hull(const SlabColumns& rows, const Box& prior, const IntervalHullOptions& options) {
  check::that(prior.dimension() > 0 && rows.parameters() == prior.dimension(), "prior box",
              "one side per parameter of the regression");
  check_finite(prior, "prior box");
  const SpreadSample sample(rows);
  HullSearch search(prior, sample.information(prior), options.threads);
  IntervalHull result;
  result.hull = prior;
  result.passes = 1;
  const auto cut = [&](const SlabColumns& some) { return search.cut(some); };
  result.empty = !(sample.each_level(cut) && cut(rows));
  result.candidates = search.candidates();
  if (result.empty) {
    result.contradiction = search.planes().contradiction();
  } else {
    certify(search.planes().certified_hull(), result);
  }
  return result;
}

IntervalHull interval_hull(core::RegressionSource& source, const Box& prior, const IntervalHullOptions& options) {
  std::vector<std::size_t> excluded = options.excluded_samples;
  std::sort(excluded.begin(), excluded.end());
  const RowSurvey known = survey(source, prior, excluded);
  Cutter cutter(prior, known.blocks, known.information, {.facets = false, .most = options.most_rows});
  ColumnPacker packer(source.outputs(), prior.dimension());
  const auto offer = [&](const SlabColumns& columns, const std::vector<char>& used) {
    return cutter.offer(columns, used);
  };
  const bool alive = packer.walk(known.sample, offer);
  IntervalHull result = hull_of(cutter, prior, [&] { return alive && packer.walk(source, excluded, offer); });
  ++result.passes;
  return result;
}

}  // namespace wheelwright::bounds
