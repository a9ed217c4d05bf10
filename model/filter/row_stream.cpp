// SPDX-License-Identifier: Apache-2.0
#include "model/filter/row_stream.hpp"

namespace wheelwright::filter {

template class RowStream<RegressorFilter>;
template class RowStream<OdometryFilter>;

}  // namespace wheelwright::filter
