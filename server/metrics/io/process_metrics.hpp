// What Prometheus' client libraries say of a process, under their names: processor time, memory, open files, start.
#pragma once

#include <prometheus/metric_family.h>

#include <vector>

namespace palpate {

/// Of this process, now. What the system does not tell is left out.
std::vector<prometheus::MetricFamily> process_metrics();

}  // namespace palpate
