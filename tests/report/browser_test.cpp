// SPDX-License-Identifier: Apache-2.0
/// \file
/// Pages in a real browser: charts are drawn from the data that were packed, and no script error is reported.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "results/report/commission_report.hpp"
#include "results/report/detect_report.hpp"
#include "results/report/failure_report.hpp"
#include "results/report/gap_report.hpp"
#include "results/report/health_report.hpp"
#include "tests/report/example.hpp"
#include "tests/report/gap_example.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::report::browser_test {
namespace {

namespace example = report_example;

constexpr const char* chromium = "/usr/bin/chromium";

class Browser : public testing::Test {
 protected:
  void SetUp() override {
    if (testing_support::skip_unless(std::filesystem::exists(chromium),
                                     std::string(chromium) + " is not installed: pages were not drawn")) {
      return;
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

  // The document after `script` has run, once every chart is drawn. What it finds it puts into `root.dataset`.
  std::string after(std::string page, const std::string& script) {
    page.replace(page.rfind("</body>"), 7,
                 "<script>{const root=document.documentElement,poll=setInterval(()=>{if(!root.dataset.ready)return;"
                 "clearInterval(poll);" +
                     script + "},20);}</script></body>");
    return drawn(page);
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

// A log of one column, which has a spike of a single sample and a gap of time.
ReportContext known_log(std::size_t rows, double start) {
  LogTable table;
  table.names = {"omega_r"};
  table.columns.resize(1);
  table.segment_starts = {0, rows / 2};
  for (std::size_t i = 0; i < rows; ++i) {
    table.t.push_back(start + 0.01 * static_cast<double>(i) + (i % 3 == 0 ? 0.001 : 0.0) + (i < rows / 2 ? 0.0 : 50.0));
    table.columns[0].push_back(1000.0 + std::sin(0.01 * static_cast<double>(i)) + (i == rows / 3 ? 5.0 : 0.0));
  }
  table.columns[0][7] = std::nan("");
  ReportContext context;
  context.signals = table;
  return context;
}

// The same in the page: t(i) from the first time on, y(i); and the chart.
const std::string kKnown =
    "const c=charts.all[0],n=c.times.t.length,"
    "t=(i)=>0.01*i+(i%3?0:0.001)+(i<n/2?0:50)-0.001,y=(i)=>1000+Math.sin(0.01*i)+(i===Math.floor(n/3)?5:0);";

TEST_F(Browser, DrawsEveryChartWithoutAScriptError) {
  const CommissionContext context = example::context(600);
  for (const std::string& page :
       {commission_report(example::done(), context), commission_report(example::empty(), context),
        detect_report(example::detection(600, true), example::done().model, context), failure_report("broken", context),
        failure_report("broken", {}), health_report({}, context),
        gap_report(gap_example::explained(), "example robot", context)}) {
    const std::string document = drawn(page);
    const std::size_t charts = times(page, "<figure class=\"chart\">");
    EXPECT_TRUE(example::holds(document, {"data-ready=\"1\""}));
    EXPECT_EQ(times(document, "<canvas"), charts);
    EXPECT_TRUE(example::lacks(document, {"data-errors"}));
    if (charts > 0) {
      EXPECT_TRUE(example::holds(document, {"data-charts=\"" + std::to_string(charts) + "\"", "data-opened="}));
    }
  }
}

TEST_F(Browser, ReportsAScriptError) {
  std::string page = failure_report("broken", example::context(60));
  const std::size_t at = page.find("root.dataset.ready");
  ASSERT_NE(at, std::string::npos);
  page.insert(at, "no_such_function();");
  EXPECT_TRUE(example::holds(drawn(page), {"data-errors"}));
}

TEST_F(Browser, UnpacksWhatWasPacked) {
  // Times of the clock of 2023, uneven, and values far from zero whose span is 7.
  const std::string document =
      after(failure_report("", known_log(2000, 1.7e9)),
            kKnown +
                "let dt=0,dy=0;for(let i=0;i<n;++i){dt=Math.max(dt,Math.abs(c.times.t[i]-c.times.t[0]-t(i)));"
                "const v=series.value(c.lines[0],c.lines[0].codes[i]);"
                "if(i!==7)dy=Math.max(dy,Math.abs(v-y(i)));else root.dataset.gap=String(v);}"
                "root.dataset.n=n;root.dataset.t=dt<=1.1e-6;root.dataset.y=dy<=7/2e4*1.001;"
                "root.dataset.breaks=JSON.stringify(c.times.breaks);");
  EXPECT_TRUE(example::holds(document, {"data-n=\"2000\"", "data-t=\"true\"", "data-y=\"true\"", "data-gap=\"null\"",
                                        "data-breaks=\"[1000]\""}));
}

TEST_F(Browser, ZoomsFromTheWholeLogToSingleSamples) {
  const std::string document =
      after(failure_report("", known_log(300'000, 0.0)),
            kKnown +
                "root.dataset.few=c.u.data[0].length<5000;root.dataset.peak=Math.max(...c.u.data[1]).toFixed(2);"
                "root.dataset.top=y(Math.floor(n/3)).toFixed(2);"
                "c.figure.scrollIntoView();const from=c.times.t[1000],to=c.times.t[1020];charts.zoom(from,to);"
                "setTimeout(()=>{const [x,v]=c.u.data,i=x.indexOf(from);root.dataset.steps=x.indexOf(to)-i;"
                "let worst=0;for(let k=0;k<=20;++k)worst=Math.max(worst,Math.abs(v[i+k]-y(1000+k)));"
                "root.dataset.exact=worst<=7/2e4*1.001;"
                "root.dataset.scale=c.u.scales.x.min===from;"
                "charts.zoom(c.times.t[n/2-2],c.times.t[n/2+1]);"
                "setTimeout(()=>{root.dataset.apart=c.u.data[1].includes(null);},200);},200);");
  EXPECT_TRUE(example::holds(document, {"data-few=\"true\"", "data-steps=\"20\"", "data-exact=\"true\"",
                                        "data-scale=\"true\"", "data-apart=\"true\""}));
  const auto value_of = [&](const std::string& name) {
    const std::size_t at = document.find("data-" + name + "=\"") + name.size() + 7;
    return document.substr(at, document.find('"', at) - at);
  };
  EXPECT_EQ(value_of("peak"), value_of("top"));
}

TEST_F(Browser, DrawsAgainForPaperAndBack) {
  const std::string page = commission_report(example::done(), example::context(600));
  const std::string document = after(page,
                                     "dispatchEvent(new Event('beforeprint'));setTimeout(()=>{"
                                     "root.dataset.paper=getComputedStyle(root).getPropertyValue('--paper').trim();"
                                     "root.dataset.width=document.querySelector('.uplot').clientWidth;"
                                     "dispatchEvent(new Event('afterprint'));},0);");
  EXPECT_TRUE(example::holds(document, {"data-paper=\"#ffffff\"", "data-width=\"680\""}));
  EXPECT_TRUE(example::lacks(document, {"data-errors", "data-print=\"1\""}));
  EXPECT_EQ(times(document, "<canvas"), times(page, "<figure class=\"chart\">"));
}

TEST_F(Browser, ClickOnAnEventZoomsToItAndShowsTheSignals) {
  const std::string document =
      after(detect_report(example::detection(900, true), example::done().model,
                          example::context(900)),  // event from 6 s to 9 s
            "document.querySelector('button.time').click();"
            "root.dataset.range=document.getElementById('zoom-range').textContent;"
            "const top=document.querySelector('#signals figure.chart').getBoundingClientRect().top;"
            "root.dataset.signals=top>=0&&top<innerHeight;document.querySelector('[data-back]').click();"
            "root.dataset.back=document.activeElement===document.querySelector('button.time');");
  // Half the event's length as margin: 4.5 s to 10.5 s, moved to end with the log at 8.99 s.
  EXPECT_TRUE(
      example::holds(document, {"data-range=\"2.99 to 8.99 s\"", "data-signals=\"true\"", "data-back=\"true\""}));
}

TEST_F(Browser, RefusesEveryRequest) {
  std::string page = failure_report("broken", example::context(60));
  page.replace(
      page.rfind("</body>"), 7,
      "<script>let refused=new Set();addEventListener('securitypolicyviolation',(e)=>{"
      "refused.add(e.effectiveDirective);document.documentElement.dataset.refused=[...refused].sort().join();});"
      "fetch('data:,x').catch(()=>0);const add=(tag,name,value)=>{const e=document.createElement(tag);"
      "e[name]=value;document.body.append(e);};add('img','src','page.html');add('iframe','src','page.html');"
      "add('script','src','page.html');add('object','data','page.html');</script></body>");
  EXPECT_TRUE(
      example::holds(drawn(page), {"data-refused=\"connect-src,frame-src,img-src,object-src,script-src-elem\""}));
}

TEST_F(Browser, SaysWhenItIsTooOld) {
  std::string page = commission_report(example::done(), example::context(60));
  page.insert(page.find("<body>") + 6, "<script>delete window.DecompressionStream;</script>");
  const std::string document = drawn(page);
  EXPECT_TRUE(example::holds(document, {"This browser is too old", "data-ready=\"1\""}));
  EXPECT_TRUE(example::lacks(document, {"data-errors", "<canvas"}));
}

}  // namespace
}  // namespace wheelwright::report::browser_test
