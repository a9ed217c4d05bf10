// SPDX-License-Identifier: Apache-2.0
#include "study/rank_coordinator.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <mpi.h>

#include "core/check.hpp"
#include "core/error.hpp"
#include "study/work_on_ranks.hpp"

namespace wheelwright::study {

std::string packed(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const InputError& error) {
    return std::string("I") + error.what();
  } catch (const Error& error) {
    return std::string("E") + error.what();
  } catch (const std::exception& error) {
    return std::string("X") + error.what();
  } catch (...) {
    return "Xsomething that is no exception was thrown";
  }
}

std::exception_ptr unpacked(int rank, std::string_view bytes) {
  check::that(!bytes.empty(), "a failure from another rank", "its kind and text");
  const std::string text = "rank " + std::to_string(rank) + ": " + std::string(bytes.substr(1));
  switch (bytes.front()) {
    case 'I': return std::make_exception_ptr(InputError(text));
    case 'E': return std::make_exception_ptr(Error(text));
    default: return std::make_exception_ptr(std::runtime_error(text));
  }
}

struct RankMessages::Sent {
  std::string bytes;
  MPI_Request request = MPI_REQUEST_NULL;
};

RankMessages::RankMessages() = default;

RankMessages::~RankMessages() {
  for (Sent& sent : sent_) {
    MPI_Wait(&sent.request, MPI_STATUS_IGNORE);
  }
}

void RankMessages::send(int rank, RankWord word, std::string bytes) {
  check::that(bytes.size() <= static_cast<std::size_t>(std::numeric_limits<int>::max()),
              "a result on its way to rank 0", "less than 2 GiB");
  Sent& sent = sent_.emplace_back();
  sent.bytes = std::move(bytes);
  MPI_Isend(sent.bytes.data(), static_cast<int>(sent.bytes.size()), MPI_BYTE, rank, static_cast<int>(word),
            MPI_COMM_WORLD, &sent.request);
}

std::optional<RankMessage> RankMessages::receive() {
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
  if (there == 0) {
    return std::nullopt;
  }
  int size = 0;
  MPI_Get_count(&status, MPI_BYTE, &size);
  RankMessage message{status.MPI_SOURCE, static_cast<RankWord>(status.MPI_TAG)};
  message.bytes.resize(static_cast<std::size_t>(size));
  MPI_Recv(message.bytes.data(), size, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return message;
}

bool RankMessages::sending() {
  sent_.remove_if([](Sent& sent) {
    int left = 0;
    MPI_Test(&sent.request, &left, MPI_STATUS_IGNORE);
    return left != 0;
  });
  return !sent_.empty();
}

void append(std::string& bytes, std::uint64_t number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void append(std::string& bytes, std::uint64_t item, std::string_view result) {
  append(bytes, item);
  append(bytes, result.size());
  bytes += result;
}

std::uint64_t taken_number(std::string_view& bytes) {
  std::uint64_t number = 0;
  check::that(bytes.size() >= sizeof number, "a message between ranks", "a whole number");
  std::memcpy(&number, bytes.data(), sizeof number);
  bytes.remove_prefix(sizeof number);
  return number;
}

std::pair<std::uint64_t, std::string_view> taken_result(std::string_view& bytes) {
  const std::uint64_t item = taken_number(bytes);
  const std::uint64_t size = taken_number(bytes);
  check::that(bytes.size() >= size, "a message between ranks", "a whole result");
  const std::string_view result = bytes.substr(0, size);
  bytes.remove_prefix(size);
  return {item, result};
}

namespace {

constexpr int kMessagesALook = 64;
constexpr std::size_t kMostHeld = 1024;

// The first line that differs, of each.
std::pair<std::string, std::string> first_difference(std::string_view a, std::string_view b) {
  const auto line = [](std::string_view& text) {
    const std::string_view first = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), first.size() + 1));
    return std::string(first);
  };
  std::pair<std::string, std::string> lines;
  do {
    lines = {line(a), line(b)};
  } while (lines.first == lines.second && !(a.empty() && b.empty()));
  return lines;
}

}  // namespace

RankCoordinator::RankCoordinator(int size, const Work& work, const std::string& fingerprint, const RunOptions& options)
    : work_(work),
      fingerprint_(fingerprint),
      options_(options),
      shares_(static_cast<std::size_t>(size)),
      team_(work.evaluate, options.threads) {
  shares_[0] = {options.threads, 0, 2 * options.threads, 0, true};
}

RunCount RankCoordinator::run(const std::function<ResultStore&()>& open) {
  try {
    store_ = &open();
  } catch (...) {
    fail(std::current_exception());
  }
  LookInterval interval;
  while (!stopping_ || !all_ended()) {
    const bool busy = look();
    adapt();
    if (!stopping_ && all_agree()) {
      hand_out();
      if (next_ == work_.items && all_idle()) {
        stop();
      }
    }
    team_.wait(interval.next(busy || messages_.sending()));
  }
  say_to_all(RankWord::leave);
  while (messages_.sending()) {
    team_.wait(interval.next(true));
  }
  if (failure_) {
    std::rethrow_exception(failure_);
  }
  return count_;
}

bool RankCoordinator::look() {
  bool busy = false;
  while (std::optional<ItemTeam::Outcome> outcome = team_.take()) {
    busy = true;
    ++shares_[0].arrived;
    if (outcome->failure) {
      fail(outcome->failure);
    } else {
      keep(outcome->item, outcome->result);
    }
  }
  for (int k = 0; k < kMessagesALook; ++k) {
    const std::optional<RankMessage> message = messages_.receive();
    if (!message) {
      break;
    }
    busy = true;
    try {
      take_in(*message);
    } catch (...) {
      fail(std::current_exception());
    }
  }
  return busy;
}

void RankCoordinator::take_in(const RankMessage& message) {
  Share& share = shares_[static_cast<std::size_t>(message.rank)];
  std::string_view bytes = message.bytes;
  switch (message.word) {
    case RankWord::hello: check_hello(message); break;
    case RankWord::results:
      while (!bytes.empty()) {
        const auto [item, result] = taken_result(bytes);
        ++share.arrived;
        keep(item, result);
      }
      break;
    case RankWord::failure: fail(unpacked(message.rank, bytes)); break;
    case RankWord::ended: share.ended = true; break;
    default: break;
  }
}

void RankCoordinator::check_hello(const RankMessage& message) {
  std::string_view bytes = message.bytes;
  Share& share = shares_[static_cast<std::size_t>(message.rank)];
  share.threads = taken_number(bytes);
  share.most = 2 * share.threads;
  if (bytes != fingerprint_) {
    const auto [there, here] = first_difference(bytes, fingerprint_);
    throw InputError("rank " + std::to_string(message.rank) + " has '" + there + "' where rank 0 has '" + here +
                     "': expected the same files and options on every rank");
  }
}

void RankCoordinator::keep(std::size_t item, std::string_view result) {
  try {
    store_->put(item, result);
    ++count_.evaluated;
    tell();
  } catch (...) {
    fail(std::current_exception());
  }
}

// A rank of which more results than threads arrive between two looks needs more in stock.
void RankCoordinator::adapt() {
  for (Share& share : shares_) {
    if (share.arrived > share.threads) {
      share.most = std::clamp(4 * share.arrived, share.most, std::max(kMostHeld, share.most));
    } else if (share.arrived != 0) {
      share.most = std::max(2 * share.threads, share.most / 2);
    }
    share.held -= std::min(share.held, share.arrived);
    share.arrived = 0;
  }
}

void RankCoordinator::hand_out() {
  std::vector<std::string> batches(shares_.size());
  // Small stocks at the end, so that nobody waits for what another has in stock.
  const std::size_t stock = (work_.items - next_) / (2 * shares_.size());
  try {
    for (bool more = true; more;) {
      more = false;
      for (std::size_t rank = 0; rank < shares_.size(); ++rank) {
        Share& share = shares_[rank];
        if (share.held >= std::min(share.most, share.threads + stock)) {
          continue;
        }
        const std::optional<std::size_t> item = next_item();
        if (!item) {
          break;
        }
        more = true;
        ++share.held;
        if (rank == 0) {
          team_.give(*item);
        } else {
          append(batches[rank], *item);
        }
      }
    }
  } catch (...) {
    fail(std::current_exception());
  }
  for (std::size_t rank = 1; rank < batches.size() && !stopping_; ++rank) {
    if (!batches[rank].empty()) {
      messages_.send(static_cast<int>(rank), RankWord::items, std::move(batches[rank]));
    }
  }
}

std::optional<std::size_t> RankCoordinator::next_item() {
  while (next_ < work_.items) {
    const std::size_t item = next_++;
    if (!store_->has(item)) {
      return item;
    }
    ++count_.found;
    tell();
  }
  return std::nullopt;
}

void RankCoordinator::tell() const {
  if (options_.progress) {
    options_.progress(count_.found + count_.evaluated, work_.items);
  }
}

void RankCoordinator::stop() {
  if (stopping_) {
    return;
  }
  stopping_ = true;
  team_.drop();
  say_to_all(RankWord::stop);
}

void RankCoordinator::say_to_all(RankWord word) {
  for (std::size_t rank = 1; rank < shares_.size(); ++rank) {
    messages_.send(static_cast<int>(rank), word);
  }
}

void RankCoordinator::fail(const std::exception_ptr& failure) {
  if (!failure_) {
    failure_ = failure;
  }
  stop();
}

bool RankCoordinator::all_agree() const {
  return std::ranges::all_of(shares_, [](const Share& share) { return share.threads != 0; });
}

bool RankCoordinator::all_idle() const {
  return std::ranges::all_of(shares_, [](const Share& share) { return share.held == 0; });
}

bool RankCoordinator::all_ended() {
  return team_.held() == 0 && std::ranges::all_of(shares_, [](const Share& share) { return share.ended; });
}

}  // namespace wheelwright::study
