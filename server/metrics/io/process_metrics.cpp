#include "server/metrics/io/process_metrics.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace palpate {
namespace {

using prometheus::MetricFamily;
using prometheus::MetricType;

MetricFamily single(const char* name, const char* help, MetricType type, double value) {
  prometheus::ClientMetric metric;
  (type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
  return {name, help, type, {metric}};
}

double seconds_of(const ::timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

}  // namespace

std::vector<MetricFamily> process_metrics() {
  std::vector<MetricFamily> families;
  ::rusage usage{};
  if (::getrusage(RUSAGE_SELF, &usage) == 0)
    families.push_back(single("process_cpu_seconds_total", "Processor time.", MetricType::Counter,
                              seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime)));
  long pages = 0, resident = 0;
  if (std::ifstream("/proc/self/statm") >> pages >> resident)
    families.push_back(single("process_resident_memory_bytes", "Resident memory.", MetricType::Gauge,
                              static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE))));
  std::error_code none;
  const std::filesystem::directory_iterator files("/proc/self/fd", none);
  if (!none)
    families.push_back(single("process_open_fds", "Open files.", MetricType::Gauge,
                              static_cast<double>(std::distance(begin(files), end(files)))));
  return families;
}

}  // namespace palpate
