// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/rank_messages.hpp>

#include <cstring>
#include <limits>

#include <mpi.h>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

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

}  // namespace wheelwright
