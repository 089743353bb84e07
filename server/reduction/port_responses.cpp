// What a patch is made of at its port: the first directions of a basis, and snapshots.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>

#include "server/reduction/patch_parts.hpp"
#include "server/reduction/static_indentation.hpp"

namespace palpate {

Matrix prescribed_motion(const LinearPort& model) {
  Matrix motion = Matrix::Zero(model.at.masses().size(), model.grasp() ? 3 : 0);
  if (!model.grasp()) return motion;
  const auto row = 3 * static_cast<Eigen::Index>(model.body.coordinate(model.tool_port().node));
  for (Eigen::Index axis = 0; axis < (model.frame.dynamics().body().planar ? 2 : 3); ++axis) motion(row + axis, axis) = 1;
  return motion;
}

std::vector<ToolLoad> wrenches(const LinearPort& model) {
  std::vector<ToolLoad> all = model.suture.spans;
  if (model.others.own == 0 && model.others.shaft.empty()) return all;
  struct At {
    const Port* port;
    std::size_t tool;
    Vec3 place = Vec3::Zero();
  };
  std::vector<At> contacts{{&model.port(), model.which}};
  for (const OtherTools::Contact& own : std::span(model.others.contacts).first(model.others.own))
    contacts.push_back({own.port, own.tool});
  for (const OtherTools::Contact& own : model.others.shaft) contacts.push_back({own.port, own.tool});
  const auto count = static_cast<double>(contacts.size());
  Vec3 middle = Vec3::Zero();
  for (At& contact : contacts) {
    const ToolPort& port = model.frame.ports()[contact.tool];
    contact.place = position_of(model.frame.skin(), port, weights_of(model.frame.skin(), port), model.frame.state().x);
    middle += contact.place / count;
  }
  constexpr double kLongestM = 1, kTurnedRad = 0.2, kClosedM = 0.01;  // more than any hand goes; within the life of a patch
  constexpr double kLeastLeverM = 0.001;                              // less: the contacts are on the axis
  const auto n = model.at.masses().size();
  // Adds the load by which each contact goes its way; `most`: of the root mean square of the ways.
  const auto add = [&](const auto& way, const auto& most) {
    double lever2 = 0;
    for (const At& contact : contacts) lever2 += way(contact).squaredNorm() / count;
    const double lever = std::sqrt(lever2);
    if (lever < kLeastLeverM) return;
    ToolLoad& load = all.emplace_back(Vector::Zero(n), Vector::Zero(n), most(lever));
    for (const At& contact : contacts)
      for (std::size_t k = 0; k < 3; ++k) {
        const double share = way(contact)[static_cast<Eigen::Index>(k)] / (lever * count);
        load.load += share * contact.port->input[k];
        load.response += share * contact.port->response[k];
      }
  };
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    add([&](const At&) { return Vec3(Vec3::Unit(axis)); }, [](double) { return kLongestM; });
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    add([&](const At& contact) { return Vec3(Vec3::Unit(axis).cross(contact.place - middle)); },
        [](double lever) { return kTurnedRad * lever; });
  if (model.frame.has_jaws(model.which)) {
    const auto closes = [&](const At& contact) {
      const bool on_jaw = model.frame.ports()[contact.tool].sphere.on_jaw();
      return on_jaw ? Vec3(-model.frame.normal(contact.tool)) : Vec3(Vec3::Zero());
    };
    add(closes, [](double) { return kClosedM; });
  }
  for (const OtherTools::Contact& own : model.others.shaft) {
    ToolLoad& push = all.emplace_back(Vector::Zero(n), Vector::Zero(n), kLongestM);
    for (std::size_t k = 0; k < 3; ++k) {
      const double share = model.frame.tool(own.tool).axis[static_cast<Eigen::Index>(k)];
      push.load += share * own.port->input[k];
      push.response += share * own.port->response[k];
    }
  }
  return all;
}

KrylovStart krylov_start(const LinearPort& model) {
  const Port& port = model.port();
  KrylovStart start{{port.response.begin(), port.response.end()}, {}, model.p.residual(), model.p.motion()};
  if (model.grasp()) return start;
  if (!model.suture.spans.empty()) {
    start.fine = {model.suture.spans.back().load.cwiseQuotient(model.at.masses())};
  } else if (model.hyper() || !port.slides.empty()) {
    const Vec3 inwards = -model.frame.normal(model.which);
    Vector push = Vector::Zero(model.at.masses().size());
    for (std::size_t axis = 0; axis < 3; ++axis) push += inwards[static_cast<Eigen::Index>(axis)] * port.input[axis];
    start.fine = {push.cwiseQuotient(model.at.masses())};
  } else {
    for (const Vector& b : port.input) start.fine.push_back(b.cwiseQuotient(model.at.masses()));
  }
  if (model.hyper()) {
    // A snapshot's weight is how far hands go, and jaws that close on tissue stop there, while both faces push hard.
    if (model.others.own > 0 && model.frame.has_jaws(model.which))
      for (ToolLoad& wrench : wrenches(model)) start.fine.push_back(std::move(wrench.response));
    return start;
  }
  for (ToolLoad& wrench : wrenches(model)) start.ports.push_back(std::move(wrench.response));
  start.ports.insert(start.ports.end(), port.slides.begin(), port.slides.end());
  return start;
}

/// Adds the push along its normal of each of the tool's other contacts that will begin to touch, scaled to how deep it will get.
void add_beginning_contacts(const LinearPort& model, SnapshotSet& to) {
  constexpr double kLeastM = 5e-4, kMostM = 0.02;  // a contact that just begins; more than any patch is good for
  const double horizon_s = seconds(model.request.horizon);
  for (const OtherTools::Contact& own : std::span(model.others.contacts).first(model.others.own)) {
    FrameModel& frame = model.frame;
    if (frame.ports()[own.tool].touching || !frame.will_touch(own.tool, model.request.horizon)) continue;
    const Vec3 normal = frame.normal(own.tool);
    Vector push = Vector::Zero(model.at.masses().size());
    for (std::size_t axis = 0; axis < 3; ++axis) push += normal[static_cast<Eigen::Index>(axis)] * own.port->response[axis];
    const double moved = normal.dot(gather(own.port->b, push));
    const double depth_m = -normal.dot(frame.gap(own.tool) + horizon_s * frame.tool(own.tool).velocity);
    if (moved > 0) to.add(SnapshotKind::slide, push, std::clamp(depth_m, kLeastM, kMostM) / moved);
  }
}

/// Port responses, scaled to the tool's likely motion along each axis; for a touch indentations and slides, and where several
/// contacts of the tool touch or will, their pushes together, those of contacts that begin, and slides.
SnapshotSet port_snapshots(const LinearPort& model, const KrylovStart& start) {
  const double horizon_s = seconds(model.request.horizon);
  const Port& port = model.port();
  const Vec3 far = expected_motion(model.tool(), horizon_s);
  const Matrix prescribed = prescribed_motion(model);
  SnapshotSet snapshots;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Vector& x = start.ports[static_cast<std::size_t>(axis)];
    if (model.grasp()) {
      snapshots.add(SnapshotKind::port_response, x + prescribed.col(axis), far[axis]);
    } else {
      const double moved = gather(port.b, x)[axis];
      snapshots.add(SnapshotKind::port_response, x, moved > 0 ? far[axis] / moved : 1);  // 1 if the body is fixed
    }
  }
  for (const ToolLoad& span : model.suture.spans) {
    const double moved = span.load.dot(span.response);
    if (moved > 0) snapshots.add(SnapshotKind::slide, span.response, far.norm() / moved);
  }
  if (model.grasp() || model.tool_port().on_path()) return snapshots;
  const IndentationRequest request{model.frame.skin().weights(model.tool_port().point), start.ports,
                                   expected_indentations(model.tool(), -model.frame.normal(model.which), horizon_s),
                                   model.p.shift(), model.p.diagonal()};
  for (Vector& x : model.frame.indentations(model.which).shapes(model.at, request))
    snapshots.add(SnapshotKind::indentation, std::move(x));
  for (const Vector& x : port.slides) snapshots.add(SnapshotKind::slide, x);
  const auto others = std::span(model.others.contacts).first(model.others.own);
  const auto touches = [&](const OtherTools::Contact& own) { return model.frame.will_touch(own.tool, model.request.horizon); };
  if (!std::ranges::any_of(others, touches)) return snapshots;
  for (const ToolLoad& wrench : wrenches(model)) {
    const double moved = wrench.load.dot(wrench.response);
    if (moved > 0) snapshots.add(SnapshotKind::slide, wrench.response, std::min(wrench.most_m, far.norm()) / moved);
  }
  add_beginning_contacts(model, snapshots);
  for (const OtherTools::Contact& own : others)
    for (const Vector& x : own.port->slides) snapshots.add(SnapshotKind::slide, x);
  return snapshots;
}

}  // namespace palpate
