// Process metrics under the names of Prometheus' client libraries: processor time, memory, open files, start.
#pragma once

#include <prometheus/metric_family.h>

#include <vector>

namespace palpate {

/// Returns the present metrics of this process, without those that the system does not provide.
std::vector<prometheus::MetricFamily> process_metrics();

}  // namespace palpate
