#include "server/reduction/suture_loads.hpp"

namespace palpate {
namespace {

const SutureState::Thread& thread_of(const FrameModel& frame, std::size_t which) {
  return frame.state().sutures->threads[*frame.ports()[which].suture];
}

/// Returns a load given at nodes in the coordinates of the operator.
Vector restricted(const Linearisation& at, const std::vector<std::pair<std::uint32_t, Vec3>>& load) {
  Vector y = Vector::Zero(at.masses().size());
  for (const auto& [node, force] : load) scatter(at.body->restricted({{node, 1.0}}), force, y);
  mask(*at.held, y);
  return y;
}

}  // namespace

SutureLoads suture_loads(const FrameModel& frame, const Linearisation& at, SharedSystem& p, std::size_t which) {
  SutureLoads loads;
  const ToolPort& port = frame.ports()[which];
  if (!port.suture) return loads;
  const Sutures& sutures = frame.dynamics().sutures();
  const SutureState::Thread& thread = thread_of(frame, which);
  const std::vector<SutureBite>& bites = *thread.bites;
  Vector f = Vector::Zero(frame.state().x.size());
  sutures.add_forces(frame.state(), *port.suture, f);
  std::vector<std::pair<std::uint32_t, Vec3>> forces;
  for (std::uint32_t i = 0; i < frame.dynamics().nodes(); ++i)
    if (!at_node(f, i).isZero(0)) forces.emplace_back(i, at_node(f, i));
  loads.force = restricted(at, forces);
  std::vector<Sutures::Block> blocks;
  sutures.add_tangents(frame.state(), *port.suture, blocks);
  for (const Sutures::Block& block : blocks) loads.stiffness.push_back({restricted(at, block.y), block.stiffness_n_m});
  const SutureShape shape = shape_of(thread.law, sutures.place_of(frame.state(), *port.suture));
  for (std::size_t i = 1; i <= bites.size(); ++i) {
    std::vector<std::pair<std::uint32_t, Vec3>> pull;
    for (const auto& [node, weight] : bites[i - 1].at) pull.emplace_back(node, weight * shape.along[i]);
    if (i < bites.size())
      for (const auto& [node, weight] : bites[i].at) pull.emplace_back(node, -weight * shape.along[i]);
    ToolLoad& span = loads.spans.emplace_back();
    span.load = restricted(at, pull);
  }
  std::vector<SolveColumn> columns;
  for (ToolLoad& span : loads.spans) columns.push_back({&span.load, &span.response});
  if (!p.solve(columns)) loads.spans.clear();
  return loads;
}

void add_suture(const LinearPort& model, const Matrix& v, PatchSuture& to) {
  const SutureState::Thread& thread = thread_of(model.frame, model.which);
  const BodyState& state = model.frame.state();
  const std::uint32_t number = *model.tool_port().suture;
  to.law = thread.law;
  to.length_m = thread.length_m;
  const SuturePlace place = model.frame.dynamics().sutures().place_of(state, number);
  for (std::size_t j = 0; j < thread.bites->size(); ++j) {
    to.bites[j].position = place.points[j];
    const NodeWeights b = model.at.body->restricted((*thread.bites)[j].at);
    to.bites[j].rows.resize(3, v.cols());
    for (Eigen::Index m = 0; m < v.cols(); ++m) to.bites[j].rows.col(m) = gather(b, v.col(m));
  }
}

}  // namespace palpate
