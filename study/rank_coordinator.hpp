// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rank 0's part of run_work_on_ranks(), non-blocking messages between ranks that keep no processor busy, and
/// exceptions that are passed between ranks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "study/work.hpp"
#include "study/work_on_ranks.hpp"

namespace wheelwright::study {

/// The exception as bytes: its kind (InputError, Error or another) and its text.
[[nodiscard]] std::string packed(const std::exception_ptr& failure);

/// The exception again: InputError, Error or std::runtime_error, "rank `rank`: " before its text. Throws
/// InvalidArgument where `bytes` is none.
[[nodiscard]] std::exception_ptr unpacked(int rank, std::string_view bytes);

/// Meaning of a message.
enum class RankWord : int {
  hello = 1,    ///< to rank 0: threads, and the fingerprint of what is to be done
  items = 2,    ///< from rank 0: items to be evaluated
  results = 3,  ///< to rank 0: items and their results
  failure = 4,  ///< to rank 0: an item failed
  stop = 5,     ///< from rank 0: forget what waits; there is nothing more
  ended = 6,    ///< to rank 0: nothing more comes
  leave = 7,    ///< from rank 0, when all have ended: the next message is one of another run
};

/// A message that arrived.
struct RankMessage {
  int rank = 0;  ///< of the sender
  RankWord word = RankWord::hello;
  std::string bytes = {};
};

/// Messages of this process over MPI_COMM_WORLD; MPI has to be running. To be called from the thread that started it.
class RankMessages {
 public:
  RankMessages();
  /// Waits until all that was sent has left.
  ~RankMessages();
  RankMessages(const RankMessages&) = delete;
  RankMessages& operator=(const RankMessages&) = delete;

  /// Sends `bytes`, in order, without waiting for the receiver. Throws InvalidArgument for 2 GiB and more.
  void send(int rank, RankWord word, std::string bytes = {});
  /// The next message, where one has arrived.
  [[nodiscard]] std::optional<RankMessage> receive();
  /// True if something that was sent has not left yet.
  [[nodiscard]] bool sending();

 private:
  struct Sent;
  std::list<Sent> sent_;
};

/// Numbers and texts in a message.
void append(std::string& bytes, std::uint64_t number);
void append(std::string& bytes, std::uint64_t item, std::string_view result);
[[nodiscard]] std::uint64_t taken_number(std::string_view& bytes);
[[nodiscard]] std::pair<std::uint64_t, std::string_view> taken_result(std::string_view& bytes);

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

}  // namespace wheelwright::study
