#include <algorithm>
#include <cmath>

#include "common/patch/packed_numbers.hpp"
#include "common/wire/patch_wire.hpp"
#include "common/wire/sense.hpp"

namespace palpate {
namespace {

/// Iterates over numbers whose count was checked before.
template <class T>
class Walk {
 public:
  explicit Walk(const flatbuffers::Vector<T>* vector) : vector_(vector) {}
  T next() { return vector_->Get(at_++); }
  void skip(int count) { at_ += static_cast<flatbuffers::uoffset_t>(count); }
  int left() const { return vector_ ? static_cast<int>(vector_->size() - at_) : 0; }

 private:
  const flatbuffers::Vector<T>* vector_;
  flatbuffers::uoffset_t at_ = 0;
};

/// Returns the number of modes whose numbers fill `count` floats, -1 when there is none.
int modes_of(int count, int (*floats)(int)) {
  for (int r = 0; r <= kMaxModes; ++r)
    if (floats(r) == count) return r;
  return -1;
}

void read_modes(Walk<float>& floats, Walk<std::int16_t>& shorts, int r, Patch& patch) {
  patch.stiffness.resize(r);
  patch.damping.resize(r, r);
  patch.g.resize(r);
  patch.q_rate.resize(r);
  if (r == 0) return;
  for (int i = 0; i < r; ++i) patch.stiffness[i] = floats.next();
  const float unit = floats.next();
  for (int i = 0; i < r; ++i) patch.damping(i, i) = unit * packed::from_half(static_cast<std::uint16_t>(shorts.next()));
  for (ModeVector* v : {&patch.g, &patch.q_rate}) {
    const double step = floats.next();
    for (int i = 0; i < r; ++i) (*v)[i] = shorts.next() * step;
  }
  for (int i = 0; i < r; ++i)
    for (int j = 0; j < i; ++j) {
      const double both = std::sqrt(std::max(0.0, patch.damping(i, i)) * std::max(0.0, patch.damping(j, j)));
      patch.damping(i, j) = patch.damping(j, i) = shorts.next() * static_cast<double>(pack::kCouplingStep) * both;
    }
}

/// Returns the step of column m of the port rows.
double row_step(const flatbuffers::Vector<std::int16_t>& shorts, int r, int m) {
  return std::ldexp(1.0, shorts.Get(static_cast<flatbuffers::uoffset_t>(mode_shorts(r) + m)));
}

void read_port(Walk<float>& floats, int r, ModePort& port) {
  port.resize(r, 3);
  for (int i = 0; i < r; ++i)
    for (int k = 0; k < 3; ++k) port(i, k) = floats.next();
}

WireFault read_attach(const wire::Patch& table, Patch& patch) {
  Walk<float> floats(table.floats());
  Walk<std::int16_t> shorts(table.shorts());
  const int r = modes_of(floats.left(), attach_floats);
  if (r < 0 || !table.attach() || table.touch() || table.normals() || shorts.left() != mode_shorts(r))
    return WireFault::malformed;
  read_modes(floats, shorts, r, patch);
  read_port(floats, r, patch.b_k);
  read_port(floats, r, patch.b_d);
  patch.tool_velocity = pack::from(table.attach()->tool_velocity());
  patch.k_port = pack::from(table.attach()->k_port());
  patch.d_port = pack::from(table.attach()->d_port());
  return WireFault::none;
}

void read_surface(Walk<std::int16_t>& shorts, int r, const wire::Patch& table, Patch& patch) {
  const wire::TouchPort& touch = *table.touch();
  auto& surface = patch.surface;
  shorts.skip(r);  // row_step()
  const Vec3 origin = pack::from(touch.origin());
  const auto vertices = std::span(surface.vertices).first(static_cast<std::size_t>(surface.vertex_count));
  vertices[0].position = origin;
  for (auto& vertex : vertices.subspan(1))
    for (int k = 0; k < 3; ++k) vertex.position[k] = origin[k] + shorts.next() * static_cast<double>(touch.step());
  for (auto& vertex : vertices) {
    vertex.rows.resize(3, r);
    for (int m = 0; m < r; ++m) {
      const double step = row_step(*table.shorts(), r, m);
      for (int k = 0; k < 3; ++k) vertex.rows(k, m) = shorts.next() * step;
    }
  }
  for (int t = 0; t < surface.triangle_count; ++t)
    surface.triangles[static_cast<std::size_t>(t)] = unpack_corners(static_cast<std::uint16_t>(shorts.next()));
}

void read_normals(const flatbuffers::Vector<std::uint16_t>* normals, PortSurface& surface) {
  if (!normals) return;
  for (flatbuffers::uoffset_t i = 0; i < normals->size(); i += 2)
    surface.vertices[i / 2].normal = unpack_normal(normals->Get(i), normals->Get(i + 1));
}

WireFault read_touch(const wire::Patch& table, Patch& patch) {
  Walk<float> floats(table.floats());
  Walk<std::int16_t> shorts(table.shorts());
  const int r = modes_of(floats.left(), touch_floats);
  const int vertices = table.head()->vertices();
  if (r < 0 || !table.touch() || table.attach() || vertices < 1 || vertices > kMaxPortVertices) return WireFault::malformed;
  const int triangles = shorts.left() - mode_shorts(r) - surface_shorts(r, vertices);
  if (triangles < 0 || triangles > kMaxPortTriangles) return WireFault::malformed;
  const wire::TouchPort& touch = *table.touch();
  if (table.normals() && static_cast<int>(table.normals()->size()) != 2 * vertices) return WireFault::malformed;
  if (touch.weight_0() + touch.weight_1() > pack::kWeightMax) return WireFault::out_of_range;
  patch.surface.vertex_count = vertices;
  patch.surface.triangle_count = triangles;
  read_modes(floats, shorts, r, patch);
  read_surface(shorts, r, table, patch);
  read_normals(table.normals(), patch.surface);
  patch.contact_stiffness_n_m = touch.coupling();
  patch.friction = touch.friction();
  patch.c_static = pack::from(touch.c_static());
  const int rest = pack::kWeightMax - touch.weight_0() - touch.weight_1();
  patch.point = {table.head()->triangle(), Vec3(touch.weight_0(), touch.weight_1(), rest) / pack::kWeightMax};
  return WireFault::none;
}

WireFault read_own_contact(const wire::OwnContact& sent, OtherContact& own) {
  if (sent.touching() > 1) return WireFault::out_of_range;
  own.touching = sent.touching() == 1;
  own.gap = pack::from(sent.gap(), std::ldexp(1.0F, sent.gap_exponent()));
  own.normal = unpack_normal(sent.normal_u(), sent.normal_v());
  const double along = pack::kComplianceUnit_m_n * packed::from_half(sent.c_normal()),
               across = pack::kComplianceUnit_m_n * packed::from_half(sent.c_across());
  own.c_static = across * Mat3::Identity() + (along - across) * own.normal * own.normal.transpose();
  return WireFault::none;
}

WireFault read_others(const wire::Patch& table, Patch& patch) {
  const int own = table.own_contacts() ? static_cast<int>(table.own_contacts()->size()) : 0, r = patch.modes();
  const int count = own + (table.others() ? static_cast<int>(table.others()->size()) : 0);
  Walk<std::int16_t> rows(table.other_rows());
  if (count > (patch.contact == ContactKind::touch ? kMaxOtherContacts : 0) || rows.left() != 3 * r * (count - own))
    return WireFault::malformed;
  const auto* const laws = table.other_laws();
  if (laws && static_cast<int>(laws->size()) != count - own) return WireFault::malformed;
  patch.others.count = count;
  patch.others.own = own;
  for (int o = 0; o < own; ++o) {
    OtherContact& contact = patch.others.of[static_cast<std::size_t>(o)];
    contact.rows.setZero(3, r);
    const wire::OwnContact& sent = *table.own_contacts()->Get(static_cast<flatbuffers::uoffset_t>(o));
    if (const WireFault fault = read_own_contact(sent, contact); fault != WireFault::none) return fault;
  }
  for (int o = own; o < count; ++o) {
    const wire::OtherContact& sent = *table.others()->Get(static_cast<flatbuffers::uoffset_t>(o - own));
    if (sent.touching() > 1) return WireFault::out_of_range;
    OtherContact& other = patch.others.of[static_cast<std::size_t>(o)];
    other.touching = sent.touching() == 1;
    other.gap = pack::from(sent.gap());
    other.c_static = pack::from(sent.c_static());
    other.velocity = pack::from(sent.velocity(), pack::kVelocityStep);
    other.acceleration = pack::from(sent.acceleration(), pack::kAccelerationStep);
    other.normal = unpack_normal(sent.normal_u(), sent.normal_v());
    if (laws) {
      const wire::ContactLaw& law = *laws->Get(static_cast<flatbuffers::uoffset_t>(o - own));
      other.law = ContactParameters{law.coupling(), law.friction()};
    }
    other.rows.resize(3, r);
    for (int m = 0; m < r; ++m) {
      const double step = row_step(*table.shorts(), r, m);
      for (int k = 0; k < 3; ++k) other.rows(k, m) = rows.next() * step;
    }
  }
  return WireFault::none;
}

WireFault read_tool_body(const wire::Patch& table, Patch& patch) {
  const auto spheres = table.spheres() ? static_cast<int>(table.spheres()->size()) : 0;
  const bool has_contacts = patch.contact == ContactKind::touch && !patch.constant;
  const auto jaws = table.jaws() ? static_cast<int>(table.jaws()->size()) : 0;
  if (jaws != 0 ? jaws != spheres : table.opening() != 0) return WireFault::malformed;
  const auto own = table.own_contacts() ? static_cast<int>(table.own_contacts()->size()) : 0;
  if (!table.body()) return spheres == 0 && own == 0 ? WireFault::none : WireFault::malformed;
  const wire::ToolBody& body = *table.body();
  if (body.own() != own || spheres != (has_contacts ? 1 + own : 0)) return WireFault::malformed;
  MessageValidator sense;
  sense.turn(body.turn());
  patch.turn = pack::from(body.turn());
  patch.torque = pack::from(body.torque());
  patch.opening = pack::opening_from(table.opening());
  for (int j = 0; j < spheres; ++j) {
    const auto at = static_cast<flatbuffers::uoffset_t>(j);
    (j == 0 ? patch.sphere : patch.others.of[static_cast<std::size_t>(j - 1)].sphere) =
        sense.sphere(*table.spheres()->Get(at), jaws > 0 ? table.jaws()->Get(at) : nullptr);
  }
  return sense.fault();
}

WireFault read_needle(const wire::Patch& table, Patch& patch) {
  if (!table.needle()) return WireFault::none;
  const wire::Needle& sent = *table.needle();
  const int r = patch.modes(), layers = sent.layers() ? static_cast<int>(sent.layers()->size()) : 0;
  Walk<std::int16_t> rows(sent.rows());
  if (patch.contact != ContactKind::touch || !patch.turn || layers < 1 || layers > kMaxNeedleLayers || !sent.points() ||
      sent.points()->size() != kNeedlePoints || rows.left() != 3 * r * kNeedlePoints)
    return WireFault::malformed;
  PatchNeedle& needle = patch.needle;
  needle.layers.count = layers;
  needle.layers.length_m = sent.length();
  for (int k = 0; k < layers; ++k) {
    const wire::NeedleLayer& layer = *sent.layers()->Get(static_cast<flatbuffers::uoffset_t>(k));
    needle.layers.of[static_cast<std::size_t>(k)] = {layer.begins(), layer.puncture(), layer.cutting(), layer.friction()};
  }
  needle.tip = {sent.inside(), sent.depth(), sent.front(), sent.layer()};
  for (int j = 0; j < kNeedlePoints; ++j) {
    const wire::NeedlePoint& from = *sent.points()->Get(static_cast<flatbuffers::uoffset_t>(j));
    PatchNeedle::Point& point = needle.points[static_cast<std::size_t>(j)];
    point.position = pack::from(from.position());
    point.bond_m = from.bond();
    point.rows.resize(3, r);
    for (int m = 0; m < r; ++m) {
      const double step = row_step(*table.shorts(), r, m);
      for (int k = 0; k < 3; ++k) point.rows(k, m) = rows.next() * step;
    }
  }
  return WireFault::none;
}

WireFault read_suture(const wire::Patch& table, Patch& patch) {
  if (!table.suture()) return WireFault::none;
  const wire::Suture& sent = *table.suture();
  const int r = patch.modes(), bites = sent.bites() ? static_cast<int>(sent.bites()->size()) : 0;
  Walk<std::int16_t> rows(sent.rows());
  Walk<float> lengths(sent.lengths());
  if (patch.contact != ContactKind::touch || bites < 1 || bites > kMaxBites || lengths.left() != bites + 1 ||
      rows.left() != 3 * r * bites)
    return WireFault::malformed;
  if ((sent.flags() & ~kAllThreadFlags) != 0) return WireFault::out_of_range;
  PatchSuture& suture = patch.suture;
  suture.law = {bites,
                sent.stiffness(),
                sent.friction(),
                sent.drag(),
                (sent.flags() & kFirstTiedFlag) != 0,
                (sent.flags() & kLastTiedFlag) != 0,
                (sent.flags() & kBarbedFlag) != 0,
                sent.tear()};
  for (int i = 0; i <= bites; ++i) suture.length_m[static_cast<std::size_t>(i)] = lengths.next();
  for (int j = 0; j < bites; ++j) {
    PatchSuture::Bite& bite = suture.bites[static_cast<std::size_t>(j)];
    bite.position = pack::from(*sent.bites()->Get(static_cast<flatbuffers::uoffset_t>(j)));
    bite.rows.resize(3, r);
    for (int m = 0; m < r; ++m) {
      const double step = row_step(*table.shorts(), r, m);
      for (int k = 0; k < 3; ++k) bite.rows(k, m) = rows.next() * step;
    }
  }
  return WireFault::none;
}

WireFault read_load(const wire::Patch& table, Patch& patch) {
  patch.load_for = Micros{table.load_for()};
  if (!table.load_rate()) return table.load_for() == 0 || patch.others.count > 0 ? WireFault::none : WireFault::malformed;
  Walk<float> load(table.load_rate());
  if (load.left() != patch.modes() || load.left() == 0) return WireFault::malformed;
  patch.load_rate.resize(patch.modes());
  for (int i = 0; i < patch.modes(); ++i) patch.load_rate[i] = load.next();
  return WireFault::none;
}

WireFault read_fading(const wire::Patch& table, Patch& patch) {
  Walk<float> numbers(table.fading());
  Walk<std::int16_t> pulls(table.pulls());
  const int branches = numbers.left() / 3, variables = patch.modes() + (patch.contact == ContactKind::attach ? 3 : 0);
  if (numbers.left() != 3 * branches || branches > static_cast<int>(kMaxPronyBranches) || pulls.left() != branches * variables)
    return WireFault::malformed;
  patch.fading.count = branches;
  for (PatchBranch& branch : patch.fading.branches()) {
    branch.prony.share = numbers.next();
    branch.prony.time_s = numbers.next();
    const double step = numbers.next();
    branch.pull.resize(variables);
    for (int i = 0; i < variables; ++i) branch.pull[i] = pulls.next() * step;
  }
  return WireFault::none;
}

WireFault read_body(const wire::Patch& table, Patch& patch) {
  if (!patch.constant) {
    WireFault fault = patch.contact == ContactKind::touch ? read_touch(table, patch) : read_attach(table, patch);
    if (fault == WireFault::none) fault = read_others(table, patch);
    if (fault == WireFault::none) fault = read_tool_body(table, patch);
    if (fault == WireFault::none) fault = read_needle(table, patch);
    if (fault == WireFault::none) fault = read_suture(table, patch);
    if (fault == WireFault::none) fault = read_load(table, patch);
    return fault == WireFault::none ? read_fading(table, patch) : fault;
  }
  const bool bare = !table.floats() && !table.shorts() && !table.normals() && !table.touch() && !table.attach() &&
                    !table.load_rate() && !table.fading() && !table.pulls() && !table.others() && !table.other_rows() &&
                    !table.needle() && !table.jaws() && !table.suture() && !table.own_contacts() && !table.other_laws();
  return bare ? read_tool_body(table, patch) : WireFault::malformed;
}

}  // namespace

WireFault read_patch(const wire::Patch& table, Patch& patch) {
  if (!table.head()) return WireFault::malformed;
  const wire::PatchHead& head = *table.head();
  MessageValidator sense;
  sense.time(pack::time_from(head.stamp()));
  sense.that(head.scheme() < kSchemeNames.size() && (head.flags() & ~kAllFlags) == 0);
  if (!sense.ok()) return sense.fault();
  patch.stamp = pack::time_from(head.stamp());
  patch.seq = head.seq();
  patch.valid_for = Micros{head.valid_for()};
  patch.force = pack::from(head.force());
  patch.tool = pack::from(head.tool());
  patch.trust_radius_m = head.trust_radius();
  patch.scheme = static_cast<Scheme>(head.scheme());
  patch.contact = (head.flags() & kTouchFlag) ? ContactKind::touch : ContactKind::attach;
  patch.constant = (head.flags() & kConstantFlag) != 0;
  patch.touching = (head.flags() & kTouchingFlag) != 0;
  patch.has_terms = (head.flags() & kTermsFlag) != 0;
  if (const WireFault fault = read_body(table, patch); fault != WireFault::none) return fault;
  return check(patch) == PatchFault::none ? WireFault::none : WireFault::patch_refused;
}

}  // namespace palpate
