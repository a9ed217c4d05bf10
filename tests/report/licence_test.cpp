// SPDX-License-Identifier: Apache-2.0
// What a page embeds keeps its notice in every copy, as its licence asks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "results/report/page.hpp"

namespace wheelwright::report {
namespace {

using ::testing::HasSubstr;

TEST(EveryPage, KeepsTheNoticeOfUPlot) {
  const std::string html = page(PageContent{});
  const std::size_t notice = html.find("Copyright (c) 2022 Leon Sorokin");
  ASSERT_NE(notice, std::string::npos);
  EXPECT_THAT(html, HasSubstr("The MIT License (MIT)"));
  EXPECT_THAT(html, HasSubstr("The above copyright notice and this permission notice shall be included"));
  EXPECT_LT(notice, html.find("var uPlot=")) << "in front of what it is about";
}

}  // namespace
}  // namespace wheelwright::report
