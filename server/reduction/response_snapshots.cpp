#include "server/reduction/response_snapshots.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

#include "server/sampling/nonlinear_elements.hpp"

namespace palpate {
namespace {

constexpr double kNegligibleLoads = 0.03;  // share of the loads' squares without a response; more: fewer solves
constexpr double kToleranceFactor = 3;     // SolveColumn::tolerance_factor: less certain than the port responses

/// Returns the loads that are not negligible, the smallest first.
std::vector<std::size_t> those_that_matter(const std::vector<Vector>& loads) {
  std::vector<double> squares;
  for (const Vector& b : loads) squares.push_back(b.squaredNorm());
  std::vector<std::size_t> order(loads.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return squares[i] < squares[j]; });
  const double all = std::accumulate(squares.begin(), squares.end(), 0.0);
  double left_out = 0;
  std::erase_if(order, [&](std::size_t k) { return (left_out += squares[k]) <= kNegligibleLoads * all; });
  return order;
}

/// Returns second-order loads of each pair of motions that act together.
std::vector<Vector> second_order_loads(const Linearisation& at, std::vector<Vector> acting, double horizon_s) {
  acting.emplace_back(horizon_s * at.velocity());
  assert(at.part);
  std::vector<Vector> forces = second_order_forces(at.part->dynamics(), at.part->state(), at.moved(side_by_side(acting)));
  for (Vector& f : forces) f = at.gathered(f);
  return forces;
}

}  // namespace

bool add_responses(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve, const ResponseRequest& request,
                   SnapshotSet& to) {
  const double s = request.shift_1_s;
  assert(s > 0 && request.horizon_s > 0 && start.residual.size() == at.masses().size());
  std::vector<Vector> acting, held_still;
  for (const Snapshot& snapshot : to.all()) {
    if (snapshot.kind != SnapshotKind::port_response && snapshot.kind != SnapshotKind::slide) continue;
    acting.emplace_back(snapshot.weight * snapshot.state);
    mask(*at.held, held_still.emplace_back(acting.back()));
  }
  std::vector<Vector> moments = moment_inputs(at, s, held_still), second_order;
  for (Vector& b : moments) b *= s;
  if (request.second_order) second_order = second_order_loads(at, std::move(acting), request.horizon_s);
  std::vector<Vector> responses(moments.size() + second_order.size());
  std::vector<SolveColumn> columns;
  std::vector<SnapshotKind> kinds;
  const auto ask = [&](const std::vector<Vector>& loads, SnapshotKind kind, Vector* to_be_found) {
    for (const std::size_t k : those_that_matter(loads)) {
      columns.push_back({&loads[k], &to_be_found[k], kToleranceFactor});
      kinds.push_back(kind);
    }
  };
  ask(moments, SnapshotKind::moment, responses.data());
  ask(second_order, SnapshotKind::second_order, responses.data() + moments.size());
  if (!solve(columns)) return false;
  to.add(SnapshotKind::residual, start.residual);
  to.add(SnapshotKind::own_motion, start.motion, s);
  for (std::size_t k = 0; k < columns.size(); ++k) to.add(kinds[k], *columns[k].x);
  return true;
}

}  // namespace palpate
