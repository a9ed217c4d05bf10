// SPDX-License-Identifier: Apache-2.0
#include "commission/constant_thresholds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <Eigen/QR>

#include "commission/validation.hpp"
#include "core/check.hpp"
#include "detector/online_model.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {
namespace {

constexpr std::size_t kFewestBlocks = 10;

// Σ YᵀY, Σ Yᵀε and Σ ε² of one output over the rows of a block, ε at θ̂.
struct Moments {
  Eigen::MatrixXd A;
  Eigen::VectorXd g;
  double square = 0.0;

  explicit Moments(Eigen::Index p) : A(Eigen::MatrixXd::Zero(p, p)), g(Eigen::VectorXd::Zero(p)) {}
  Moments& operator+=(const Moments& other) {
    A += other.A;
    g += other.g;
    square += other.square;
    return *this;
  }
};

using BlockMoments = std::vector<Moments>;  // one for each output

// The rows in whole blocks of `length` instants, and what is left over is none.
struct Blocks {
  std::size_t length = 1;
  double seconds = 0.0;  // of one
  std::vector<BlockMoments> moments;

  [[nodiscard]] std::size_t count() const { return moments.size(); }
};

// Joins each block of an even number to its neighbour.
void halve_blocks(Blocks& blocks) {
  const std::size_t half = blocks.count() / 2;
  for (std::size_t k = 0; k < half; ++k) {
    BlockMoments joined = std::move(blocks.moments[2 * k]);
    for (std::size_t i = 0; i < joined.size(); ++i) {
      joined[i] += blocks.moments[2 * k + 1][i];
    }
    blocks.moments[k] = std::move(joined);
  }
  blocks.moments.erase(blocks.moments.begin() + static_cast<std::ptrdiff_t>(half), blocks.moments.end());
  blocks.length *= 2;
}

Blocks blocks_of(core::RegressionSource& rows, const Eigen::VectorXd& estimate,
                 const ConstantThresholdOptions& options) {
  Blocks blocks;
  blocks.length = static_cast<std::size_t>(std::ceil(std::max(1.0, options.memory / options.step)));
  const BlockMoments none(rows.outputs(), Moments(estimate.size()));
  BlockMoments open = none;
  std::size_t in_open = 0, instants = 0;
  double seconds = 0.0, before = 0.0;
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    for (std::size_t k = 0; k < block.t.size(); ++k, ++instants) {
      const double past = block.t[k] - before;
      seconds += instants > 0 && past > 0.0 && past <= std::max(5.0 * options.step, options.memory) ? past : 0.0;
      before = block.t[k];
      if (in_open == blocks.length) {
        blocks.moments.push_back(std::exchange(open, none));
        in_open = 0;
        if (blocks.count() == options.most_blocks) {
          halve_blocks(blocks);
        }
      }
      for (std::size_t i = 0; i < rows.outputs(); ++i) {
        const auto row = static_cast<Eigen::Index>(k * rows.outputs() + i);
        const double residual = block.y[row] - block.Y.row(row).dot(estimate);
        open[i].A += block.Y.row(row).transpose() * block.Y.row(row);
        open[i].g += residual * block.Y.row(row).transpose();
        open[i].square += residual * residual;
      }
      ++in_open;
    }
  });
  if (in_open == blocks.length) {
    blocks.moments.push_back(std::move(open));
  }
  blocks.seconds = instants > 0 ? seconds / static_cast<double>(instants) * static_cast<double>(blocks.length) : 0.0;
  return blocks;
}

// Fits of some of the blocks, by their moments.
class BlockFits {
 public:
  BlockFits(const Blocks& blocks, const Eigen::VectorXd& estimate) : estimate_(estimate) {
    const auto p = estimate.size();
    BlockMoments total(blocks.moments.front().size(), Moments(p));
    for (const BlockMoments& block : blocks.moments) {
      for (std::size_t i = 0; i < total.size(); ++i) {
        total[i] += block[i];
      }
    }
    for (const BlockMoments& block : blocks.moments) {
      Moments weighted(p);
      for (std::size_t i = 0; i < total.size(); ++i) {
        const double weight = total[i].square > 0.0 ? 1.0 / total[i].square : 0.0;
        weighted.A += weight * block[i].A;
        weighted.g += weight * block[i].g;
      }
      blocks_.push_back(std::move(weighted));
    }
    Moments all(p);
    for (const Moments& block : blocks_) {
      all += block;
    }
    mean_ = all.g / static_cast<double>(blocks_.size());
    scale_ = all.A.diagonal().unaryExpr([](double x) { return x > 0.0 ? 1.0 / std::sqrt(x) : 0.0; });
  }

  // Of the blocks that are `used`, without block `left_out` and its neighbours.
  template <typename Used>
  [[nodiscard]] Eigen::VectorXd without(std::size_t left_out, const Used& used) const {
    Moments sum(estimate_.size());
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      if (used(k) && (k + 1 < left_out || k > left_out + 1)) {
        sum.A += blocks_[k].A;
        sum.g += blocks_[k].g - mean_;
      }
    }
    // A direction that these blocks do not show stays where θ̂ has it.
    constexpr double kShown = 1e-8;
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
    solver.setThreshold(kShown);
    solver.compute(scale_.asDiagonal() * sum.A * scale_.asDiagonal());
    return estimate_ + scale_.asDiagonal() * solver.solve(scale_.asDiagonal() * sum.g);
  }

 private:
  Eigen::VectorXd estimate_, mean_, scale_;
  std::vector<Moments> blocks_;
};

// Largest |ε| of each block (rows) in each output (columns), ε of a block by its fit of each set of fits.
std::array<Eigen::MatrixXd, 2> block_maxima(core::RegressionSource& rows, const Blocks& blocks,
                                            const std::array<std::vector<Eigen::VectorXd>, 2>& fits) {
  const std::size_t n = rows.outputs();
  std::array<Eigen::MatrixXd, 2> largest;
  largest.fill(Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(blocks.count()), static_cast<Eigen::Index>(n)));
  std::size_t instants = 0;
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    for (std::size_t k = 0; k < block.t.size(); ++k, ++instants) {
      const std::size_t at = instants / blocks.length;
      for (std::size_t i = 0; at < blocks.count() && i < n; ++i) {
        const auto row = static_cast<Eigen::Index>(k * n + i);
        for (std::size_t set = 0; set < fits.size(); ++set) {
          double& most = largest[set](static_cast<Eigen::Index>(at), static_cast<Eigen::Index>(i));
          most = std::max(most, std::abs(block.y[row] - block.Y.row(row).dot(fits[set][at])));
        }
      }
    }
  });
  return largest;
}

// As a trial on held-out driving has it.
bool held_out(std::size_t block, std::size_t blocks) {
  constexpr FoldOptions kFolds;
  return block * kFolds.blocks / blocks % kFolds.hold_out_every == kFolds.hold_out_every - 1;
}

// That `exceeded` or more of `held_out` blocks exceed the largest of `learning` ones, all of which can be exchanged.
double chance_of(std::size_t exceeded, std::size_t held_out, std::size_t learning) {
  double chance = 1.0;
  for (std::size_t j = 0; j < exceeded; ++j) {
    chance *= static_cast<double>(held_out - j) / static_cast<double>(learning + held_out - j);
  }
  return chance;
}

template <filter::RowFilter Filter>
void learn(LogSource& log, Filter filter, const std::vector<std::string>& outputs, double memory,
           const std::map<std::string, double>& stated, detector::LearntSet& channel) {
  ConstantThresholdOptions options{.step = filter.measurement().nominal_step, .memory = memory};
  for (const std::string& output : outputs) {
    const auto at = stated.find(output);
    options.stated.push_back(at != stated.end() ? std::optional(at->second) : std::nullopt);
  }
  filter::RowStream<Filter> rows(log, std::move(filter));
  channel.constant = constant_thresholds(rows, channel.estimate, options);
  log.rewind();
}

}  // namespace

std::optional<detector::ConstantThresholds> constant_thresholds(core::RegressionSource& rows,
                                                                const Eigen::VectorXd& estimate,
                                                                const ConstantThresholdOptions& options) {
  const std::size_t n = rows.outputs();
  check::positive(options.step, "step");
  check::non_negative(options.memory, "memory");
  check::that(options.stated.empty() || options.stated.size() == n, "stated", "one for each output, or none");
  check::that(options.most_blocks >= 2 * kFewestBlocks && options.most_blocks % 2 == 0, "most_blocks",
              "an even number of 20 at least");
  check::that(static_cast<std::size_t>(estimate.size()) == rows.parameters(), "estimate",
              "as many parameters as the rows have");
  detector::ConstantThresholds result;
  result.outputs.resize(n);
  bool all_stated = true;
  for (std::size_t i = 0; i < n; ++i) {
    const std::optional<double> stated = options.stated.empty() ? std::nullopt : options.stated[i];
    result.outputs[i] = {.value = stated.value_or(0.0), .stated = stated.has_value()};
    all_stated = all_stated && stated;
  }
  const Blocks blocks = blocks_of(rows, estimate, options);
  if (blocks.count() < kFewestBlocks) {
    return all_stated ? std::optional(result) : std::nullopt;
  }
  result.block = blocks.seconds;
  result.blocks = blocks.count();
  const auto learning = [&](std::size_t k) { return !held_out(k, blocks.count()); };
  const BlockFits fits(blocks, estimate);
  std::array<std::vector<Eigen::VectorXd>, 2> of_blocks;  // of all, of those that are not held out
  for (std::size_t k = 0; k < blocks.count(); ++k) {
    of_blocks[0].push_back(fits.without(k, [](std::size_t) { return true; }));
    of_blocks[1].push_back(fits.without(k, learning));
    result.learning += learning(k) ? 1 : 0;
  }
  const auto [largest, tried] = block_maxima(rows, blocks, of_blocks);
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    detector::ConstantThreshold& output = result.outputs[i];
    if (output.stated) {
      output.held_out = blocks.count();
      output.exceeded = static_cast<std::size_t>((largest.col(at).array() > output.value).count());
      continue;
    }
    output.value = largest.col(at).maxCoeff();
    double threshold = 0.0;
    for (std::size_t k = 0; k < blocks.count(); ++k) {
      threshold = learning(k) ? std::max(threshold, tried(static_cast<Eigen::Index>(k), at)) : threshold;
    }
    output.held_out = blocks.count() - result.learning;
    for (std::size_t k = 0; k < blocks.count(); ++k) {
      output.exceeded += !learning(k) && tried(static_cast<Eigen::Index>(k), at) > threshold ? 1 : 0;
    }
    output.chance = chance_of(output.exceeded, output.held_out, result.learning);
  }
  return result;
}

void learn_constant_thresholds(LogSource& log, OnlineModel& model) {
  learn(log, detector::make_filter(model), model.model.outputs, model.filter.settle / model.filter.beta,
        model.robot.thresholds, model);
  if (model.kinematic) {
    learn(log, detector::make_filter(*model.kinematic), model.kinematic->measurement.outputs(), model.kinematic->window,
          model.robot.thresholds, *model.kinematic);
  }
}

std::string sentence(const detector::ConstantThresholds& thresholds) {
  const std::optional<double> chance = thresholds.false_alarms();
  const auto most = std::ranges::max_element(thresholds.outputs, {}, &detector::ConstantThreshold::exceeded);
  if (!chance) {
    return fmt::format("constant thresholds as the robot file states them, without guarantee{}",
                       thresholds.blocks == 0
                           ? ""
                           : fmt::format(": of {} blocks of {:.3g} s of the healthy log {} exceed one", most->held_out,
                                         thresholds.block, most->exceeded));
  }
  return fmt::format(
      "constant thresholds by experiment, without guarantee: {:.3g} s of driving like the healthy log's raise a false "
      "alarm with a probability of at most {:.2g} %, one in {:.3g} s (the largest residuals of {} blocks); tried on {} "
      "blocks that were "
      "held out, {} exceeded a threshold of the other {}{}",
      thresholds.block, 100.0 * *chance, thresholds.block / *chance, thresholds.blocks, most->held_out, most->exceeded,
      thresholds.learning,
      thresholds.refuted()
          ? ": more than that lets expect, the blocks of this log are not alike, and nothing is promised"
          : "");
}

}  // namespace wheelwright::commission
