// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/rank_failure.hpp>

#include <stdexcept>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

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

}  // namespace wheelwright
