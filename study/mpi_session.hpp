// SPDX-License-Identifier: Apache-2.0
/// \file
/// MPI from its start to its end.
#pragma once

namespace wheelwright {

/// MPI, started by the constructor and ended by the destructor; one per process, since MPI starts once. Every process that
/// mpirun started has to make one, and to come to its end. Only the thread that made it calls MPI.
class MpiSession {
 public:
  /// Throws Error where MPI was started before, or does not admit a thread of its own beside others
  /// (MPI_THREAD_FUNNELED).
  MpiSession();
  ~MpiSession();
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;

  [[nodiscard]] int rank() const { return rank_; }  ///< of this process, from 0
  [[nodiscard]] int size() const { return size_; }  ///< number of processes

 private:
  int rank_ = 0;
  int size_ = 1;
};

}  // namespace wheelwright
