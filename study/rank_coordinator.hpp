// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rank 0's part of run_work_on_ranks().
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <wheelwright/study/item_team.hpp>
#include <wheelwright/study/rank_messages.hpp>
#include <wheelwright/study/work.hpp>

namespace wheelwright {

/// Hands items out, to itself as well, and takes results in.
class RankCoordinator {
 public:
  RankCoordinator(int size, const Work& work, const std::string& fingerprint, const RunOptions& options);

  /// Until every rank has ended. Arguments and failures: run_work_on_ranks().
  RunCount run(const std::function<ResultStore&()>& open);

 private:
  /// What is known of a rank.
  struct Share {
    std::size_t threads = 0;  ///< 0: it has not said hello
    std::size_t held = 0;     ///< items it has and whose results have not arrived
    std::size_t most = 0;     ///< items it should hold
    std::size_t arrived = 0;  ///< results at this look
    bool ended = false;
  };

  bool look();
  void take_in(const RankMessage& message);
  void check_hello(const RankMessage& message);
  void keep(std::size_t item, std::string_view result);
  void adapt();
  void hand_out();
  [[nodiscard]] std::optional<std::size_t> next_item();
  void tell() const;
  void stop();
  void say_to_all(RankWord word);
  void fail(const std::exception_ptr& failure);
  [[nodiscard]] bool all_agree() const;
  [[nodiscard]] bool all_idle() const;
  [[nodiscard]] bool all_ended();

  const Work& work_;
  const std::string& fingerprint_;
  const RunOptions& options_;
  ResultStore* store_ = nullptr;
  std::vector<Share> shares_;  ///< by rank
  std::size_t next_ = 0;
  bool stopping_ = false;
  RunCount count_;
  std::exception_ptr failure_;
  RankMessages messages_;
  ItemTeam team_;
};

}  // namespace wheelwright
