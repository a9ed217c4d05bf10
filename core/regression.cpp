// SPDX-License-Identifier: Apache-2.0
#include "core/regression.hpp"

#include <utility>

#include "core/check.hpp"

namespace wheelwright::core {

void RegressionBlock::resize(std::size_t instants, std::size_t n, std::size_t p) {
  outputs = n;
  parameters = p;
  sample.resize(instants);
  t.resize(instants);
  const auto rows_now = static_cast<Eigen::Index>(instants * n);
  Y.resize(rows_now, static_cast<Eigen::Index>(p));
  dY.resize(rows_now, static_cast<Eigen::Index>(p));
  y.resize(rows_now);
  dy.resize(rows_now);
}

void RegressionBlock::shorten(std::size_t instants) {
  sample.resize(instants);
  t.resize(instants);
  Y.conservativeResize(rows(), Eigen::NoChange);
  dY.conservativeResize(rows(), Eigen::NoChange);
  y.conservativeResize(rows());
  dy.conservativeResize(rows());
}

RegressionTable::RegressionTable(RegressionBlock block) : block_(std::move(block)) {
  const auto columns = static_cast<Eigen::Index>(block_.parameters);
  check::that(block_.outputs > 0 && block_.parameters > 0, "regression", "at least one output and one parameter");
  check::that(block_.Y.rows() == block_.rows() && block_.Y.cols() == columns, "regression Y", "K·n rows, p columns");
  check::that(block_.dY.rows() == block_.rows() && block_.dY.cols() == columns, "regression dY", "the shape of Y");
  check::that(block_.y.size() == block_.rows() && block_.dy.size() == block_.rows(), "regression y, dy", "K·n values");
  check::that(block_.sample.size() == block_.t.size(), "regression sample", "one for each instant");
  check::that(block_.Y.allFinite() && block_.y.allFinite(), "regression Y, y", "finite values");
  check::that((block_.dY.array() >= 0.0).all() && (block_.dy.array() >= 0.0).all() && block_.dY.allFinite() &&
                  block_.dy.allFinite(),
              "regression dY, dy", "finite bounds >= 0");
}

bool RegressionTable::next(RegressionBlock& block) {
  if (done_) {
    block.resize(0, block_.outputs, block_.parameters);
    return false;
  }
  block = block_;
  done_ = true;
  return true;
}

RegressionBlock read_all(RegressionSource& source) {
  RegressionBlock all;
  all.resize(0, source.outputs(), source.parameters());
  for_each_block(source, [&](const RegressionBlock& block) {
    all.sample.insert(all.sample.end(), block.sample.begin(), block.sample.end());
    all.t.insert(all.t.end(), block.t.begin(), block.t.end());
    all.Y.conservativeResize(all.rows(), Eigen::NoChange);
    all.dY.conservativeResize(all.rows(), Eigen::NoChange);
    all.y.conservativeResize(all.rows());
    all.dy.conservativeResize(all.rows());
    all.Y.bottomRows(block.rows()) = block.Y;
    all.dY.bottomRows(block.rows()) = block.dY;
    all.y.tail(block.rows()) = block.y;
    all.dy.tail(block.rows()) = block.dy;
  });
  source.rewind();
  return all;
}

}  // namespace wheelwright::core
