// SPDX-License-Identifier: Apache-2.0
#include "long_work.hpp"

#include <string>

namespace wheelwright::python {

void LongWork::breathe() {
  using namespace std::chrono_literals;
  {
    const std::lock_guard hold(watch_);
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < 100ms) {
      return;
    }
    last_ = now;
  }
  ask([] {
    if (PyErr_CheckSignals() != 0) {
      throw py::error_already_set();
    }
  });
}

void LongWork::tell(std::string_view text, double share) {
  breathe();
  if (progress_.is_none()) {
    return;
  }
  ask([&] { progress_(share, std::string(text)); });
}

}  // namespace wheelwright::python
