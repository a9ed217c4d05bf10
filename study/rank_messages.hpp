// SPDX-License-Identifier: Apache-2.0
/// \file
/// Messages between ranks that neither wait nor keep a processor busy.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace wheelwright {

/// What a message says.
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
  /// Whether something that was sent has not left yet.
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

}  // namespace wheelwright
