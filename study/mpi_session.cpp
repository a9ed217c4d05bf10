// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/mpi_session.hpp>

#include <mpi.h>

#include <wheelwright/core/error.hpp>

namespace wheelwright {

MpiSession::MpiSession() {
  int begun = 0;
  MPI_Initialized(&begun);
  if (begun != 0) {
    throw Error("MPI was started before in this process: expected one session");
  }
  int provided = MPI_THREAD_SINGLE;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  if (provided < MPI_THREAD_FUNNELED) {
    MPI_Finalize();
    throw Error("this MPI admits no threads: expected MPI_THREAD_FUNNELED");
  }
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
}

MpiSession::~MpiSession() { MPI_Finalize(); }

}  // namespace wheelwright
