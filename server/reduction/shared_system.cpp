#include "server/reduction/shared_system.hpp"

#include <cassert>

namespace palpate {
namespace {

constexpr double kSlidesToleranceFactor = 2.5;  // SolveColumn::tolerance_factor: slides are less certain than the present loads

}  // namespace

bool SharedSystem::prepare(const Linearisation& at, SystemKey key, double tolerance) {
  assert(key.shift_1_s >= 0 && tolerance > 0);
  key_ = std::move(key);
  at_ = at;
  at_.held = &key_.held;
  tolerance_ = tolerance;
  ports_.clear();
  residual_.resize(0);
  motion_.resize(0);
  return definite_ = solver_.prepare(at_, key_.shift_1_s, key_.clamp);
}

void SharedSystem::add_touch(std::size_t k, NodeWeights b) {
  Port& port = ports_[k];
  port.b = std::move(b);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    port.input[axis] = Vector::Zero(at_.masses().size());
    scatter(port.b, Vec3::Unit(static_cast<int>(axis)), port.input[axis]);
    mask(*at_.held, port.input[axis]);
  }
}

void SharedSystem::add_grasp(std::size_t k, std::uint32_t coordinate) {
  assert(coordinate != BodyOperator::kNone && (*at_.held)[coordinate]);
  const auto row = 3 * static_cast<Eigen::Index>(coordinate);
  Matrix units = Matrix::Zero(at_.masses().size(), 3), k_t, d_t;
  units.middleRows<3>(row).setIdentity();
  at_.body->multiply(units, k_t, d_t);
  Port& port = ports_[k];
  port.k_port = k_t.middleRows<3>(row);
  port.d_port = d_t.middleRows<3>(row);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    port.k[axis] = k_t.col(static_cast<Eigen::Index>(axis));
    port.d[axis] = d_t.col(static_cast<Eigen::Index>(axis));
    mask(*at_.held, port.k[axis]);
    mask(*at_.held, port.d[axis]);
    port.input[axis] = -port.k[axis] - shift() * port.d[axis];
  }
}

bool SharedSystem::respond(const Loads& loads) {
  std::vector<SolveColumn> columns;
  std::vector<Port*> asked;
  for (auto& [k, port] : ports_) {
    if (port.response[0].size() == 0) {
      for (std::size_t axis = 0; axis < 3; ++axis) columns.push_back({&port.input[axis], &port.response[axis]});
      asked.push_back(&port);
    }
    const auto slides = loads.slides.find(k);
    if (slides == loads.slides.end() || !port.slides.empty()) continue;
    port.slides.resize(slides->second.size());
    for (std::size_t i = 0; i < port.slides.size(); ++i)
      columns.push_back({&slides->second[i], &port.slides[i], kSlidesToleranceFactor});
  }
  if (loads.residual && residual_.size() == 0) columns.push_back({loads.residual, &residual_, kOwnToleranceFactor});
  if (loads.motion && motion_.size() == 0) columns.push_back({loads.motion, &motion_, kOwnToleranceFactor});
  if (columns.empty()) return definite_;
  definite_ = definite_ && solve(columns);
  if (!definite_) return false;  // there may be no responses
  for (Port* port : asked)
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        port->compliance(row, column) =
            port->input[static_cast<std::size_t>(row)].dot(port->response[static_cast<std::size_t>(column)]);
  return true;
}

}  // namespace palpate
