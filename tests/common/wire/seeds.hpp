// One plausible message of every kind, with numbers that no rounding step divides.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "common/patch/terms_pieces.hpp"
#include "common/wire/codec.hpp"

namespace palpate::seeds {

inline double noise(std::mt19937& random) { return static_cast<double>(random()) / 4294967296.0 * 2 - 1; }

inline Message message(Payload body) {
  Message m;
  m.instance = 0xfeedbeefcafe1234ull;
  m.station = 7;
  m.seq = 123456;
  m.clock = {Micros{9'876'543'210}, Micros{1'234'567'890'123}, Micros{1500}};
  m.body = std::move(body);
  return m;
}

/// G^T G of random vectors, so semi-definite: rows 0..2 the port, the rest the modes.
inline Eigen::MatrixXd semi_definite(std::mt19937& random, int n, double scale) {
  Eigen::MatrixXd g(n, n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) g(i, j) = noise(random);
  return scale * g.transpose() * g;
}

inline void fill_modes(std::mt19937& random, int r, Patch& patch) {
  patch.stiffness.resize(r);
  patch.g.resize(r);
  patch.q_rate.resize(r);
  for (int i = 0; i < r; ++i) {
    patch.stiffness[i] = 37.7 * std::pow(3.1, i);
    patch.g[i] = 11.3 * noise(random);
    patch.q_rate[i] = 0.21 * noise(random);
  }
  patch.damping = semi_definite(random, r, 9.7);
}

inline Patch common_patch(ContactKind contact) {
  Patch patch;
  patch.seq = 42;
  patch.stamp = Micros{9'870'000'001};
  patch.scheme = Scheme::port;
  patch.contact = contact;
  patch.force = Vec3(0.123, -1.77, 3.14159);
  patch.tool = Vec3(0.0512345678, -0.0312345678, 0.1010101010);
  patch.trust_radius_m = 0.03;
  patch.valid_for = Micros{400'000};
  return patch;
}

/// The mode stiffnesses K_i are such that [[K_p, -B_k^T], [-B_k, K]] is semi-definite: K_p = B_k^T K^-1 B_k + something.
inline Patch attach_patch(int r) {
  std::mt19937 random(100u + static_cast<unsigned>(r));
  Patch patch = common_patch(ContactKind::attach);
  fill_modes(random, r, patch);
  patch.tool_velocity = Vec3(0.01, -0.2, 0.33);
  patch.b_k.resize(r, 3);
  for (int i = 0; i < r; ++i)
    for (int k = 0; k < 3; ++k) patch.b_k(i, k) = 3 * std::sqrt(patch.stiffness[i]) * noise(random);
  patch.k_port = semi_definite(random, 3, 55.5);
  if (r > 0) patch.k_port += patch.b_k.transpose() * patch.stiffness.cwiseInverse().asDiagonal() * patch.b_k;
  const Eigen::MatrixXd d = semi_definite(random, r + 3, 2.3);
  patch.d_port = d.topLeftCorner(3, 3);
  patch.damping = d.bottomRightCorner(r, r);
  patch.b_d = -d.bottomLeftCorner(r, 3);
  return patch;
}

/// A fan of triangles around vertex 0 on a bumpy disc of 20 mm radius; `triangles` may exceed the fan, then it repeats.
inline Patch touch_patch(int r, int vertices, int triangles) {
  std::mt19937 random(200u + static_cast<unsigned>(r));
  Patch patch = common_patch(ContactKind::touch);
  fill_modes(random, r, patch);
  patch.contact_stiffness_n_m = 987.6;
  patch.friction = 0.3;
  patch.touching = true;
  patch.point = {1, Vec3(0.2, 0.3, 0.5)};
  patch.c_static = semi_definite(random, 3, 1e-4);
  patch.surface.vertex_count = vertices;
  patch.surface.triangle_count = triangles;
  for (int i = 0; i < vertices; ++i) {
    auto& vertex = patch.surface.vertices[static_cast<std::size_t>(i)];
    const double angle = 2 * M_PI * i / (vertices - 1);
    vertex.position = Vec3(0.05, -0.03, 0.1);
    if (i > 0) vertex.position += Vec3(0.02 * std::cos(angle), 0.02 * std::sin(angle), 0.003 * noise(random));
    if (i != 2) vertex.normal = Vec3(0.4 * noise(random), 0.4 * noise(random), i % 5 == 4 ? -1 : 1).normalized();
    vertex.rows.resize(3, r);
    for (int m = 0; m < r; ++m)
      for (int k = 0; k < 3; ++k) vertex.rows(k, m) = 4.4 * noise(random) / (1 + m);
  }
  const auto ring = static_cast<std::uint32_t>(vertices - 1);
  for (std::uint32_t t = 0; t < static_cast<std::uint32_t>(triangles); ++t)
    patch.surface.triangles[t] = {0, 1 + t % ring, 1 + (t + 1) % ring};
  return patch;
}

/// A patch with other tools, the first of which touches.
inline Patch shared_patch(int r, int vertices, int triangles, int others) {
  std::mt19937 random(300u + static_cast<unsigned>(r));
  Patch patch = touch_patch(r, vertices, triangles);
  patch.load_for = Micros{123'456};
  patch.others.count = others;
  for (OtherContact& other : patch.others.tools()) {
    other.touching = &other == patch.others.of.data();
    other.gap = 0.0123 * Vec3(noise(random), noise(random), noise(random));
    other.velocity = 0.3 * Vec3(noise(random), noise(random), noise(random));
    other.acceleration = 3.3 * Vec3(noise(random), noise(random), noise(random));
    other.normal = Vec3(0.4 * noise(random), 0.4 * noise(random), 1).normalized();
    other.c_static = semi_definite(random, 3, 1e-3);
    other.rows.resize(3, r);
    for (int m = 0; m < r; ++m)
      for (int k = 0; k < 3; ++k) other.rows(k, m) = 5.1 * noise(random) / (1 + m);
  }
  return patch;
}

/// Terms of springs between `nodes` nodes, with numbers of all magnitudes.
inline NonlinearTerms spring_terms(int r, bool grasp, int count, int nodes) {
  std::mt19937 random(400u + static_cast<unsigned>(r));
  const auto some = [&](Eigen::Index rows, Eigen::Index cols, float scale) {
    return Eigen::MatrixXf(Eigen::MatrixXf::NullaryExpr(rows, cols, [&] { return scale * static_cast<float>(noise(random)); }));
  };
  NonlinearTerms terms;
  const int n = r + (grasp ? 3 : 0);
  terms.variables = n;
  terms.grasp = grasp;
  terms.elements.stiffening = 30;
  terms.elements.motion = rounded(some(3 * nodes, r, 4), grasp ? nodes / 2 : -1);
  terms.elements.position = some(3, nodes, 0.01F);
  terms.elements.nodes.resize(2, count);
  for (int e = 0; e < count; ++e) terms.elements.nodes.col(e) << e % nodes, (e + 1 + e / nodes) % nodes;
  terms.elements.rest_length = some(count, 1, 0.01F).cwiseAbs().array() + 0.001F;
  terms.elements.stiffness = some(count, 1, 300).cwiseAbs();
  terms.elements.damping = some(count, 1, 3).cwiseAbs();
  terms.elements.max_slope.resize(static_cast<std::size_t>(count));
  for (std::uint8_t& slope : terms.elements.max_slope) slope = static_cast<std::uint8_t>(random());
  terms.e2 = some(pairs_of(n), 1, 1e-3F);
  return terms;
}

/// Terms of tetrahedra between `nodes` nodes, at least eight, with numbers of all magnitudes.
inline NonlinearTerms solid_terms(int r, bool grasp, int count, int nodes) {
  std::mt19937 random(500u + static_cast<unsigned>(r));
  const auto some = [&](Eigen::Index rows, Eigen::Index cols, float scale) {
    return Eigen::MatrixXf(Eigen::MatrixXf::NullaryExpr(rows, cols, [&] { return scale * static_cast<float>(noise(random)); }));
  };
  NonlinearTerms terms;
  const int n = r + (grasp ? 3 : 0);
  terms.variables = n;
  terms.grasp = grasp;
  terms.elements.law.kind = grasp ? SolidLaw::corotational : SolidLaw::veronda_westmann;
  if (!grasp) {
    terms.elements.law.shape = 2.5;
    terms.elements.law.fibres = {{0, 0.6F, 0.8F}, 0.75, 2};
  }
  terms.elements.motion = rounded(some(3 * nodes, r, 4), grasp ? nodes / 2 : -1);
  // Along a helix any four consecutive points span a volume of the same orientation.
  terms.elements.rest.resize(3, nodes);
  for (int i = 0; i < nodes; ++i)
    terms.elements.rest.col(i) << 0.02F * std::cos(1.2F * static_cast<float>(i)), 0.02F * std::sin(1.2F * static_cast<float>(i)),
        0.003F * static_cast<float>(i);
  terms.elements.position = terms.elements.rest + some(3, nodes, 0.002F);
  terms.elements.nodes.resize(4, count);
  for (int e = 0; e < count; ++e) {
    const int first = e % (nodes - 3);
    terms.elements.nodes.col(e) << first, first + 1, first + 2, first + 3;
  }
  terms.elements.stiffness = some(count, 1, 1e-3F).cwiseAbs();
  terms.elements.dilation = some(count, 1, 1e-2F).cwiseAbs();
  terms.elements.damping = some(count, 1, 0.02F).cwiseAbs();
  terms.e2 = some(pairs_of(n), 1, 1e-3F);
  return terms;
}

/// Terms without elements, for the surface of a linear patch.
inline NonlinearTerms surface_terms(int r) {
  NonlinearTerms terms;
  terms.variables = r;
  return terms;
}

/// Leaves the first vertices and triangles in the patch and moves the others to the terms.
inline void move_surface(int vertices, int triangles, Patch& patch, NonlinearTerms& terms) {
  PortSurface& s = patch.surface;
  terms.vertices.assign(s.vertices.begin() + vertices, s.vertices.begin() + s.vertex_count);
  terms.triangles.assign(s.triangles.begin() + triangles, s.triangles.begin() + s.triangle_count);
  s.vertex_count = vertices;
  s.triangle_count = triangles;
}

/// Two whole blocks and a short one, with numbers up to `most`.
inline ShapePiece shape_piece(std::mt19937& random, ShapeChannel channel, int most) {
  ShapePiece piece{4711, Micros{123456}, channel, 0x1p-15, {}};
  const auto n = static_cast<std::size_t>(components_of(channel));
  for (const auto& [index, vertices] : {std::pair{0u, 64u}, {70'000u, 64u}, {70'001u, 5u}}) {
    std::vector<std::int32_t> numbers;
    for (std::size_t i = 0; i < n * vertices; ++i) numbers.push_back(static_cast<std::int32_t>(most * noise(random)));
    append_block(index, numbers, components_of(channel), piece.blocks);
  }
  return piece;
}

inline Samples samples(int count) {
  std::mt19937 random(3);
  Samples m;
  for (int i = 0; i < count; ++i)
    m.samples.push_back({Micros{9'000'000'000 + 1000 * i + (i % 3)}, Vec3(noise(random), noise(random), 9.9 * noise(random))});
  return m;
}

/// A patch of a tool with a body, of whose spheres `own` are contacts beside that at the surface.
inline Patch body_patch(int r, int vertices, int triangles, int others, int own) {
  Patch patch = shared_patch(r, vertices, triangles, others);
  patch.turn = Eigen::Quaterniond(0.2, -0.4, 0.7, 0.1).normalized();
  patch.torque = Vec3(0.01, -0.2, 0.03);
  patch.sphere = {kToolStepM * Vec3(100, -2000, 3), 500 * kToolStepM};
  patch.others.own = own;
  for (int j = 0; j < own; ++j) {
    OtherContact& contact = patch.others.of[static_cast<std::size_t>(j)];
    contact.sphere = {kToolStepM * Vec3(-30000, j, 77), (j + 1) * kToolStepM};
    contact.rows.setZero();
    contact.velocity = contact.acceleration = Vec3::Zero();
    contact.c_static = 2e-4 * Mat3::Identity() + 3e-4 * contact.normal * contact.normal.transpose();
  }
  return patch;
}

/// The same with jaws, open by a third.
inline Patch jaws_patch(int r, int vertices, int triangles, int others, int own) {
  Patch patch = body_patch(r, vertices, triangles, others, own);
  patch.opening = 21845 / 65535.0;
  patch.sphere.hinge_m = 5000 * kToolStepM;
  patch.sphere.swing_rad = 8000 * kSwingStepRad;
  for (int j = 0; j + 1 < own; ++j) {
    ToolSphere& sphere = patch.others.of[static_cast<std::size_t>(j)].sphere;
    sphere.hinge_m = 5000 * kToolStepM;
    sphere.swing_rad = (j % 2 == 0 ? -8000 : 8000) * kSwingStepRad;
  }
  return patch;
}

/// A needle of `layers` layers, 13 mm deep where the cut is 17 mm deep.
inline Patch needle_patch(int r, int vertices, int triangles, int layers) {
  Patch patch = body_patch(r, vertices, triangles, 0, 0);
  PatchNeedle& needle = patch.needle;
  needle.layers.count = layers;
  needle.layers.length_m = 0.04;
  for (int k = 0; k < layers; ++k) needle.layers.of[static_cast<std::size_t>(k)] = {0.011 * k, 0.6 + k, 0.2 * (k + 1), 4.5 * k};
  needle.tip = {true, 0.013, 0.017, std::min(1, layers - 1)};
  for (std::size_t j = 0; j < needle.points.size(); ++j) {
    const double at = static_cast<double>(j);
    needle.points[j].position = Vec3(0.01, 0.02 - 0.001 * at, -0.01 * at);
    needle.points[j].bond_m = 0.003 * at - 0.004;
    needle.points[j].rows = (0.3 - 0.1 * at) * patch.surface.vertices[0].rows;
  }
  return patch;
}

/// A thread of `bites` bites.
inline Patch suture_patch(int r, int vertices, int triangles, int bites) {
  Patch patch = touch_patch(r, vertices, triangles);
  PatchSuture& suture = patch.suture;
  suture.law = {bites, 2000, 0.12, 0.03, true, false, false, 0.4};
  for (int i = 0; i <= bites; ++i) suture.length_m[static_cast<std::size_t>(i)] = 0.01 + 0.003 * i;
  for (std::size_t j = 0; j < static_cast<std::size_t>(bites); ++j) {
    const double at = static_cast<double>(j);
    suture.bites[j].position = Vec3(0.01 * at, 0.02 - 0.001 * at, -0.01);
    suture.bites[j].rows = (0.3 - 0.1 * at) * patch.surface.vertices[0].rows;
  }
  return patch;
}

inline std::vector<Message> every_kind() {
  std::mt19937 random(5);
  std::vector<Message> all;
  all.push_back(message(Hello{"left hand", Role::haptic, Scheme::port, 22, "right hand"}));
  all.push_back(message(Hello{"v", Role::viewer, Scheme::hold, 0, ""}));
  all.push_back(message(Welcome{"cube6", ContactKind::touch, 20, Vec3(0.1, 0.2, 0.30000001), 1500, 2996, 0x123456789abcdef0ull}));
  all.push_back(message(Refuse{RefuseReason::name_taken, "the name \"left hand\" is taken"}));
  all.push_back(message(samples(0)));
  all.push_back(message(samples(34)));
  all.push_back(message(PatchMessage{attach_patch(11)}));
  all.push_back(message(PatchMessage{attach_patch(0)}));
  all.push_back(message(PatchMessage{touch_patch(8, 12, 16)}));
  all.push_back(message(PatchMessage{touch_patch(0, 7, 6)}));
  all.push_back(message(PatchMessage{suture_patch(5, 6, 8, 6)}));
  all.push_back(message(PatchMessage{body_patch(4, 6, 8, 3, 2)}));
  all.push_back(message(PatchMessage{jaws_patch(4, 6, 8, 3, 2)}));
  all.push_back(message(PatchMessage{needle_patch(4, 6, 8, 3)}));
  Welcome tools{"w", ContactKind::touch, 20, Vec3::Zero(), 0, 0, 0, 0};
  tools.turns = true;
  all.push_back(message(tools));
  tools.jaws = true;
  all.push_back(message(tools));
  tools.parts = 3;
  tools.coupling_n_m = 1500;
  tools.tool = {{.centre = Vec3(0, 0, 0.0625), .radius_m = 0.00390625}, {.centre = Vec3(0, 0.03125, 0), .radius_m = 0.0078125}};
  all.push_back(message(tools));
  all.push_back(message(PatchMessage{shared_patch(7, 8, 9, 2)}));
  Patch constant = common_patch(ContactKind::touch);
  constant.scheme = Scheme::hold;
  constant.constant = true;
  all.push_back(message(PatchMessage{constant}));
  for (const PatchTerms& piece : to_pieces(spring_terms(6, true, 60, 40), 42)) all.push_back(message(piece));
  NonlinearTerms touched = spring_terms(6, false, 60, 40);
  Patch rest = touch_patch(6, 12, 16);
  move_surface(7, 5, rest, touched);
  for (const PatchTerms& piece : to_pieces(touched, 43)) all.push_back(message(piece));
  NonlinearTerms linear = surface_terms(9);
  Patch moved = touch_patch(9, 20, 24);
  move_surface(4, 2, moved, linear);
  moved.has_terms = true;
  all.push_back(message(PatchMessage{moved}));
  for (const PatchTerms& piece : to_pieces(linear, 45)) all.push_back(message(piece));
  for (const PatchTerms& piece : to_pieces(solid_terms(6, true, 9, 8), 44)) all.push_back(message(piece));
  all.push_back(message(Beat{Micros{-17}, true}));
  all.push_back(message(Beat{Micros{17}, false, 18.5, Micros{31'000}, {1008, 50, 4, Micros{212'345}}, 12}));
  all.push_back(message(Beat{.body_time = Micros{17}, .contact_in_reach = true, .renewed_from = 0xfffffff0u}));
  Samples playing = samples(3);
  playing.playing = 4711;
  all.push_back(message(playing));
  Samples held = samples(5);
  held.samples.back().orientation = Eigen::Quaterniond(0.5, -0.5, 0.1, 0.7).normalized();
  held.buttons = {{Micros{8'000'000'000}, 1}, {Micros{9'000'001'234}, 0xffffffffu}};
  all.push_back(message(held));
  for (ToolSample& sample : held.samples) sample.orientation = Eigen::Quaterniond(0.1, 0.5, -0.1, -0.7).normalized();
  all.push_back(message(held));
  for (std::size_t i = 0; i < held.samples.size(); ++i) held.samples[i].opening = 0.2 * static_cast<double>(i);
  all.push_back(message(held));
  held = samples(0);
  held.buttons = {{Micros{-5}, 2}};
  all.push_back(message(held));
  all.push_back(message(Welcome{"v", ContactKind::attach, 20, Vec3::Zero(), 0, 0, 0, 0.125}));
  all.push_back(message(Leave{}));
  all.push_back(message(Reset{40'000}));
  all.push_back(message(Note{7, Micros{9'876'543'210}, "Weber", "too deep \xc3\xa4"}));
  all.push_back(message(Note{1, Micros{1}, "", ""}));
  all.push_back(message(RoomList{"left", {"left", "right lung"}}));
  all.push_back(message(Beat{.resets = 3, .notes = 12}));
  all.push_back(message(Beat{.in_use = {Scheme::port, SchemeReason::link_lossy, Micros{9'000}, Micros{30'000}}}));
  all.push_back(message(Hello{"hand", Role::haptic, std::nullopt, 0, ""}));
  Hello guide{"OR 3", Role::haptic, std::nullopt, 0, ""};
  guide.guides = "OR 1";
  all.push_back(message(guide));
  guide.tool = "probe";
  all.push_back(message(guide));
  all.push_back(message(Beat{.guidance = {GuidanceHand::released, Micros{123'456}, 1.25}}));
  all.push_back(
      message(Guidance{"OR 1", true, GuidanceHand::holds, Micros{161'000}, Micros{8'000'000'000}, Vec3(0.1, -0.2, 0.3)}));
  all.push_back(message(MeshRequest{3}));
  MeshPiece mesh{0xabcdef, 1, 4, 116, {}, {}};
  for (std::uint32_t i = 0; i < kMaxPieceTriangles; ++i) mesh.triangles.push_back({i, i + 1, 70000 + i});
  all.push_back(message(mesh));
  mesh.triangles.clear();
  for (std::size_t i = 0; i < kMaxPieceVertices; ++i)
    mesh.vertices.push_back({Vec3(noise(random), 9.9 * noise(random), -0.1).unaryExpr(&to_rest_step), i % 3 == 0});
  all.push_back(message(mesh));
  mesh.vertices.clear();
  mesh.removed = {1, 7, 70000};
  all.push_back(message(mesh));
  PartPiece part{3, "table", 0x8fa3ad, 0.25, 500, 900, 7};
  for (std::uint32_t i = 0; i < kMaxPartItems; ++i) part.triangles.push_back({i, i + 1, 499 - i});
  all.push_back(message(part));
  part.triangles.clear();
  part.name = std::string(kMaxNameBytes, 'p');
  for (std::size_t i = 0; i < kMaxPartItems; ++i)
    part.vertices.push_back({Vec3(noise(random), 9.9 * noise(random), -0.1).unaryExpr(&to_rest_step)});
  all.push_back(message(part));
  all.push_back(message(MeshRequest{3 * kPartPieces + 1}));
  all.push_back(message(shape_piece(random, ShapeChannel::position, 200)));
  all.push_back(message(shape_piece(random, ShapeChannel::tension, 3)));
  all.push_back(message(ViewState{123456, 0xfedcba9876543210ull, 2, 1500}));
  RoomView room{
      1515, Micros{12'345}, 19.5, 3.25, {{"left hand", Micros{120'000}, Micros{4'000}, Micros{190'000}, 1008, 30, 7, 22}}};
  room.stations.push_back({"r", {}, {}, {}, 0, 0, 0, 0, {Scheme::hyper, SchemeReason::unknown, {}, {}}});
  all.push_back(message(room));
  room.tool = {{kToolStepM * Vec3(1, -2, 3), 4 * kToolStepM}, {Vec3::Zero(), 32000 * kToolStepM}};
  all.push_back(message(room));
  room.tool[1].hinge_m = 3000 * kToolStepM;
  room.tool[1].swing_rad = -4000 * kSwingStepRad;
  all.push_back(message(room));
  room.stations[0].tool = {"grasper", room.tool};
  room.stations[1].tool = {"point", {}};
  all.push_back(message(room));
  Patch beside = shared_patch(4, 6, 8, 2);
  beside.others.of[1].law = ContactParameters{250, 0.5};
  all.push_back(message(PatchMessage{beside}));
  all.push_back(
      message(Tools{17,
                    Micros{99},
                    3,
                    {{"left hand", Vec3(0.01, 0.02, 0.03), Vec3(1, 2, 3.3), true}, {"r", Vec3(1, 1, 1), Vec3::Zero(), false}}}));
  Tools turned{18, Micros{99}, 1, {{"pen", Vec3(1, 1, 1), Vec3::Zero(), true, Eigen::Quaterniond(0, 1, 0, 0), 3}}};
  turned.tools.push_back({"buttons", Vec3::Zero(), Vec3::Zero(), false, {}, 1, "pen", 0.25});
  all.push_back(message(turned));
  all.push_back(message(Task{"Find it", FindTask{Vec3(0.01, -0.02, 0.03), Vec3(0.01, -0.02, 0.05), 0.009, 0.012}}));
  all.push_back(message(Task{"Hold", PressTask{0.5, 1.25, 3}}));
  TraceTask trace{{}, 0.002};
  for (std::size_t i = 0; i < kMaxLinePoints; ++i)
    trace.line.push_back({Vec3(0.005 * static_cast<double>(i), noise(random), 0.1), Vec3(noise(random), -0.2, 1).normalized()});
  all.push_back(message(Task{std::string(kMaxTaskText, 't'), trace}));
  return all;
}

inline std::vector<std::byte> bytes_of(const Message& message) {
  std::vector<std::byte> bytes(kMaxDatagramBytes);
  bytes.resize(encode(message, bytes));
  return bytes;
}

}  // namespace palpate::seeds
