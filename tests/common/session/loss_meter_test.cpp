#include "common/session/loss_meter.hpp"

#include <catch2/catch.hpp>

using palpate::LinkReport;
using palpate::LossMeter;

namespace {

LinkReport report_of(const LossMeter& meter) {
  LinkReport report;
  meter.fill(report);
  return report;
}

}  // namespace

TEST_CASE("nothing is known of a link before enough came to judge by") {
  LossMeter meter;
  CHECK(report_of(meter).judged == 0);
  for (std::uint32_t i = 0; i < LossMeter::kGrace; ++i) meter.take(i);
  CHECK(report_of(meter).judged == 0);
}

TEST_CASE("lost are the numbers that did not come, and the longest run of them is found") {
  LossMeter meter;
  for (std::uint32_t i = 1000; i < 1500; ++i)
    if (i % 100 != 7 && !(i >= 1220 && i < 1232)) meter.take(i);
  const LinkReport report = report_of(meter);
  CHECK(report.judged == 500 - LossMeter::kGrace);
  CHECK(report.lost == 5 + 12);
  CHECK(report.longest_run == 12);
}

TEST_CASE("what comes late or twice is not lost, and the newest numbers are not judged yet") {
  LossMeter meter;
  for (std::uint32_t i = 0; i < 300; i += 2) {
    meter.take(i + 1);
    meter.take(i);
    meter.take(i);
  }
  CHECK(report_of(meter).lost == 0);
  for (std::uint32_t i = 305; i < 310; ++i) meter.take(i);
  CHECK(report_of(meter).lost == 0);
}

TEST_CASE("losses are forgotten once the window has gone past them, and numbers may wrap around") {
  LossMeter meter;
  std::uint32_t seq = 0xffffff00u;
  for (int i = 0; i < 600; ++i, ++seq)
    if (i < 200 || i >= 230) meter.take(seq);
  CHECK(report_of(meter).lost == 30);
  CHECK(report_of(meter).longest_run == 30);
  for (int i = 0; i < LossMeter::kWindow; ++i) meter.take(seq++);
  CHECK(report_of(meter).lost == 0);
  meter.take(seq + 5000);
  CHECK(report_of(meter).lost == LossMeter::kWindow - LossMeter::kGrace);
}
