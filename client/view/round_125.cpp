#include "client/view/round_125.hpp"

#include <cmath>
#include <initializer_list>

namespace palpate {

float round_up_125(float x) {
  const float decade = std::pow(10.0F, std::floor(std::log10(x)));
  for (const float step : {1.0F, 2.0F, 5.0F}) {
    if (x <= step * decade * 1.0001F) return step * decade;
  }
  return 10 * decade;
}

float round_down_125(float x) {
  const float decade = std::pow(10.0F, std::floor(std::log10(x)));
  for (const float step : {5.0F, 2.0F}) {
    if (x * 1.0001F >= step * decade) return step * decade;
  }
  return decade;
}

float contour_step(float color_max) { return round_up_125(0.199F * color_max); }

}  // namespace palpate
