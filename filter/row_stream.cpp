// SPDX-License-Identifier: Apache-2.0
#include "filter/row_stream.hpp"

namespace wheelwright::filter {

template class RowStream<RegressorFilter>;
template class RowStream<OdometryFilter>;

}  // namespace wheelwright::filter
