// SPDX-License-Identifier: Apache-2.0
/// \file
/// A store that notices misuse.
#pragma once

#include <atomic>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "study/work.hpp"

namespace wheelwright::testing {

/// Results in memory. A failed test where two threads call it at once, or an item is put twice.
class MemoryStore : public study::ResultStore {
 public:
  bool has(std::size_t item) override {
    const Alone alone(inside_);
    return results.contains(item);
  }
  void put(std::size_t item, std::string_view result) override {
    const Alone alone(inside_);
    EXPECT_TRUE(results.emplace(item, result).second) << "item " << item << " was put twice";
  }

  std::map<std::size_t, std::string> results;

 private:
  struct Alone {
    explicit Alone(std::atomic<int>& inside) : count(inside) { EXPECT_EQ(count++, 0) << "two threads in the store"; }
    ~Alone() { --count; }
    Alone(const Alone&) = delete;
    Alone& operator=(const Alone&) = delete;
    std::atomic<int>& count;
  };
  std::atomic<int> inside_ = 0;
};

/// A text that only this item has, longer for some than for others.
inline std::string text_of(std::size_t item) { return std::string(item * 37 % 101, 'x') + std::to_string(item); }

}  // namespace wheelwright::testing
