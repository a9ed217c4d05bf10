// SPDX-License-Identifier: Apache-2.0
#include "formats/files/bytes.hpp"

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace wheelwright::files::xxh64_test {
namespace {

std::uint64_t hash_of(std::string_view text) {
  Xxh64 hash;
  hash.update(text.data(), text.size());
  return hash.digest();
}

// Values of the reference implementation (libxxhash 0.8.1, seed 0).
TEST(Xxh64, AgreesWithTheReference) {
  EXPECT_EQ(hash_of(""), 0xef46db3751d8e999ULL);
  EXPECT_EQ(hash_of("a"), 0xd24ec4f1a98c6e5bULL);
  EXPECT_EQ(hash_of("abc"), 0x44bc2cf5ad770999ULL);
  EXPECT_EQ(hash_of("wheelwright"), 0xa083bd29736a3a82ULL);
  EXPECT_EQ(hash_of("t,omega_r,omega_l,tau_r,tau_l,x,y"), 0x4ef97f8cd8011811ULL);
  EXPECT_EQ(hash_of("t,omega_r,omega_l,tau_r,tau_l,x,y,theta,gyro_z,command_r,command_l, "
                    "0.005,-0.0383,0.0000,-0.011,0.056,-0.1129"),
            0x498f98ab647b6599ULL);
}

TEST(Xxh64, DoesNotDependOnThePieces) {
  std::mt19937_64 random(3);
  std::string text;
  for (int k = 0; k < 1000; ++k) {
    text += static_cast<char>(random());
  }
  for (int k = 0; k < 200; ++k) {
    Xxh64 hash;
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t size = std::min<std::size_t>(random() % 80, text.size() - begin);
      hash.update(text.data() + begin, size);
      begin += size;
    }
    ASSERT_EQ(hash.digest(), hash_of(text));
  }
}

TEST(Xxh64, TextHasSixteenDigits) { EXPECT_EQ(Xxh64().text(), "xxh64:ef46db3751d8e999"); }

}  // namespace
}  // namespace wheelwright::files::xxh64_test
