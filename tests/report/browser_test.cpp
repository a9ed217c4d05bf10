// SPDX-License-Identifier: Apache-2.0
/// \file
/// Pages in a real browser: charts are drawn and no script error is reported.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include <wheelwright/report/commission_report.hpp>
#include <wheelwright/report/detect_report.hpp>
#include <wheelwright/report/gap_report.hpp>

#include "report/example.hpp"
#include "report/gap_example.hpp"

namespace wheelwright {
namespace {

namespace example = report_example;

constexpr const char* chromium = "/usr/bin/chromium";

class Browser : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(chromium)) {
      GTEST_SKIP() << chromium << " is not installed: pages were not drawn";
    }
    std::string pattern = (std::filesystem::temp_directory_path() / "wheelwright-report-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    directory_ = pattern;
  }
  void TearDown() override {
    if (!directory_.empty()) {
      std::filesystem::remove_all(directory_);
    }
  }

  // The document after its scripts have run.
  std::string drawn(const std::string& page) {
    const std::string file = directory_ / "page.html";
    std::ofstream(file) << page;
    const std::string command =
        std::string(chromium) +
        " --headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
        "--disable-component-update --disable-sync --user-data-dir='" +
        (directory_ / "profile").string() + "' --virtual-time-budget=5000 --dump-dom 'file://" + file + "' 2>/dev/null";
    std::string out;
    FILE* pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) {
      return out;
    }
    std::array<char, 65536> buffer{};
    for (std::size_t n = 0; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
      out.append(buffer.data(), n);
    }
    pclose(pipe);
    return out;
  }

  std::filesystem::path directory_;
};

std::size_t times(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
    ++n;
  }
  return n;
}

TEST_F(Browser, DrawsEveryChartWithoutAScriptError) {
  const ReportContext context = example::context(600);
  for (const std::string& page :
       {commission_report(example::done(), context), commission_report(example::empty(), context),
        detect_report(example::detection(600, true), example::done().model, context), failure_report("broken", {}),
        gap_report(gap_example::explained(), "example robot", context)}) {
    const std::string document = drawn(page);
    const std::size_t charts = times(page, "<figure class=\"chart\">");
    EXPECT_TRUE(example::holds(document, {"data-ready=\"1\""}));
    EXPECT_TRUE(example::holds(document, {"data-charts=\"" + std::to_string(charts) + "\""}));
    EXPECT_EQ(times(document, "<canvas"), charts);
    EXPECT_TRUE(example::lacks(document, {"data-errors"}));
  }
}

TEST_F(Browser, ReportsAScriptError) {
  std::string page = failure_report("broken", example::context(60));
  const std::size_t at = page.rfind("root.dataset.ready");
  ASSERT_NE(at, std::string::npos);
  page.insert(at, "no_such_function();");
  EXPECT_TRUE(example::holds(drawn(page), {"data-errors"}));
}

TEST_F(Browser, DrawsAgainForPaperAndBack) {
  std::string page = commission_report(example::done(), example::context(600));
  page.replace(page.rfind("</body>"), 7,
               "<script>dispatchEvent(new Event('beforeprint'));const root=document.documentElement;setTimeout(()=>{"
               "root.dataset.paper=getComputedStyle(root).getPropertyValue('--paper').trim();"
               "root.dataset.width=document.querySelector('.uplot').clientWidth;"
               "dispatchEvent(new Event('afterprint'));},0);</script></body>");
  const std::string document = drawn(page);
  EXPECT_TRUE(example::holds(document, {"data-paper=\"#ffffff\"", "data-width=\"680\""}));
  EXPECT_TRUE(example::lacks(document, {"data-errors", "data-print=\"1\""}));
  EXPECT_EQ(times(document, "<canvas"), times(page, "<figure class=\"chart\">"));
}

TEST_F(Browser, ClickOnAnEventZoomsToIt) {
  std::string page = detect_report(example::detection(900, true), example::done().model,
                                   example::context(900));  // event from 6 s to 9 s
  page.replace(
      page.rfind("</body>"), 7,
      "<script>document.querySelector('button.time').click();"
      "document.documentElement.dataset.range=document.getElementById('zoom-range').textContent;</script></body>");
  // Half the event's length as margin: 4.5 s to 10.5 s, moved to end with the log at 8.99 s.
  EXPECT_TRUE(example::holds(drawn(page), {"data-range=\"2.99 to 8.99 s\""}));
}

}  // namespace
}  // namespace wheelwright
