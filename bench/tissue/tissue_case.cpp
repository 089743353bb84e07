#include "bench/tissue/tissue_case.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace palpate {

SolidElement solid_element(TissueElement element) {
  if (element == TissueElement::spring) throw std::logic_error("a spring is no finite element");
  return element == TissueElement::hexahedron ? SolidElement::hexahedron : SolidElement::tetrahedron;
}

double order_of(const std::vector<int>& cells, const std::vector<double>& errors) {
  constexpr double kRoundingError = 1e-6;
  const auto n = static_cast<double>(cells.size());
  double x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!(std::abs(errors[i]) > kRoundingError)) return std::numeric_limits<double>::quiet_NaN();
    const double log_h = -std::log(cells[i]), log_e = std::log(std::abs(errors[i]));
    x += log_h;
    y += log_e;
    xx += log_h * log_h;
    xy += log_h * log_e;
  }
  return n < 2 ? std::numeric_limits<double>::quiet_NaN() : (n * xy - x * y) / (n * xx - x * x);
}

const std::vector<TissueCase>& tissue_cases() {
  static const std::vector<TissueCase> all = [] {
    std::vector<TissueCase> list;
    for (auto family : {homogeneous_cases, curved_cases, layer_cases, membrane_cases, calculix_cases, time_cases, febio_cases}) {
      std::vector<TissueCase> more = family();
      std::move(more.begin(), more.end(), std::back_inserter(list));
    }
    return list;
  }();
  return all;
}

std::vector<TissueCase> surgery_cases() {
  std::vector<TissueCase> all = tool_cases();
  for (TissueCase& more : tear_cases()) all.push_back(std::move(more));
  return all;
}

const TissueCase& tissue_case(const std::string& name) {
  static const std::vector<TissueCase> surgery = surgery_cases();
  for (const std::vector<TissueCase>* list : {&tissue_cases(), &surgery})
    for (const TissueCase& c : *list)
      if (c.name == name) return c;
  throw std::logic_error("no case of tissue is called " + name);
}

}  // namespace palpate
