// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/work_on_ranks.hpp>

#include <exception>
#include <optional>
#include <string_view>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/study/item_team.hpp>
#include <wheelwright/study/look_interval.hpp>
#include <wheelwright/study/rank_coordinator.hpp>
#include <wheelwright/study/rank_failure.hpp>
#include <wheelwright/study/rank_messages.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t kBytesAMessage = std::size_t{1} << 20U;

// The part of the ranks behind 0.
class Helper {
 public:
  Helper(const Work& work, const std::string& fingerprint, std::size_t threads) : team_(work.evaluate, threads) {
    std::string hello;
    append(hello, threads);
    messages_.send(0, RankWord::hello, hello + fingerprint);
  }

  RunCount run() {
    LookInterval interval;
    while (!stopping_ || team_.held() != 0) {
      const bool busy = listen();
      const bool sent = send_outcomes();
      team_.wait(interval.next(busy || sent || messages_.sending()));
    }
    send_outcomes();
    messages_.send(0, RankWord::ended);
    while (!left_) {
      team_.wait(interval.next(listen() || messages_.sending()));
    }
    return count_;
  }

 private:
  bool listen() {
    const std::optional<RankMessage> message = messages_.receive();
    if (!message) {
      return false;
    }
    std::string_view bytes = message->bytes;
    if (message->word == RankWord::stop) {
      stopping_ = true;
      team_.drop();
    }
    left_ = message->word == RankWord::leave;
    while (message->word == RankWord::items && !failed_ && !stopping_ && !bytes.empty()) {
      team_.give(taken_number(bytes));
    }
    return true;
  }

  bool send_outcomes() {
    bool sent = false;
    std::string results;
    while (std::optional<ItemTeam::Outcome> outcome = team_.take()) {
      sent = true;
      if (outcome->failure) {
        fail(outcome->failure);
        continue;
      }
      ++count_.evaluated;
      append(results, outcome->item, outcome->result);
      if (results.size() >= kBytesAMessage) {
        send(std::exchange(results, {}));
      }
    }
    if (!results.empty()) {
      send(std::move(results));
    }
    return sent;
  }

  void send(std::string results) {
    try {
      messages_.send(0, RankWord::results, std::move(results));
    } catch (...) {
      fail(std::current_exception());
    }
  }

  // Rank 0 answers with `stop`.
  void fail(const std::exception_ptr& failure) {
    failed_ = true;
    team_.drop();
    messages_.send(0, RankWord::failure, packed(failure));
  }

  bool stopping_ = false;
  bool failed_ = false;
  bool left_ = false;
  RunCount count_;
  RankMessages messages_;
  ItemTeam team_;
};

}  // namespace

RunCount run_work_on_ranks(const MpiSession& mpi, const Work& work, const std::string& fingerprint,
                           const std::function<ResultStore&()>& open, const RunOptions& options) {
  check::that(options.threads >= 1, "threads", "at least 1");
  check::that(options.shard.index == 0 && options.shard.count == 1, "a shard on ranks", "the whole");
  check::that(work.items == 0 || work.evaluate != nullptr, "evaluate", "a function");
  if (mpi.rank() == 0) {
    return RankCoordinator(mpi.size(), work, fingerprint, options).run(open);
  }
  return Helper(work, fingerprint, options.threads).run();
}

}  // namespace wheelwright
