// The motion of a hand that inserts a needle, as `palpate-lab needle` plays it: from 5 mm above the surface straight along the
// inward normal to a depth, 0.3 s of rest there, and back to where it began. Each way is a minimum-jerk curve with the given peak
// speed. The needle's axis is the outward normal.
#pragma once

#include "bench/measure/examination.hpp"

namespace palpate {

Motion insertion(const ExaminedPlace& place, double depth_m, double peak_m_s);

}  // namespace palpate
