// Round figures for legends and scale bars: 1, 2 or 5 times a power of ten.
#pragma once

namespace palpate {

/// Returns the smallest round figure that is not below x > 0.
float round_up_125(float x);
/// Returns the largest round figure that is not above x > 0.
float round_down_125(float x);
/// Returns the step between contour lines on a body whose legend ends at `color_max`.
float contour_step(float color_max);

}  // namespace palpate
