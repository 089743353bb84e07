#include "client/igtl/igtl_scene.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr double kMm = 1e3, kHeldShare = 0.15, kTipSpacings = 2;
constexpr std::size_t kStlTitleBytes = 80;

struct UpName {
  const char* name;
  Eigen::Vector3i rotation_deg;
};
const UpName kUps[] = {{"superior", {0, 0, 0}},    {"inferior", {180, 0, 0}}, {"anterior", {90, 0, 0}},
                       {"posterior", {-90, 0, 0}}, {"right", {0, -90, 0}},    {"left", {0, 90, 0}}};

Mat3 rotation(const Eigen::Vector3i& degrees) {
  const auto about = [&](Eigen::Index axis) {
    return Mat3(Eigen::AngleAxisd(degrees[axis] * M_PI / 180, Vec3::Unit(axis)).toRotationMatrix().array().round());
  };
  return about(2) * about(1) * about(0);
}

/// Rounds to a tenth of a millimetre [m].
double rounded_m(double metres) { return std::round(1e4 * metres) / 1e4; }

template <class Value>
void append_little(std::string& out, Value value) {
  static_assert(std::endian::native == std::endian::little);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

PatientUp patient_up(std::string_view name) {
  for (const UpName& up : kUps)
    if (up.name == name) return {up.name, up.rotation_deg, rotation(up.rotation_deg).transpose()};
  throw InputError("--up", "'" + std::string(name) + "' is no direction of a patient", kPatientUps);
}

std::string igtl_moment(const ViewMoment& moment, std::span<const Triangle> triangles, std::span<const Vec3f> rest,
                        const PatientUp& up, std::uint64_t stamp) {
  std::string out;
  for (const ToolView& tool : moment.tools) {
    const Mat3 axes =
        tool.orientation ? Mat3(up.to_ras * tool.orientation->cast<double>().toRotationMatrix()) : Mat3(Mat3::Identity());
    out += igtl_transform(tool.station, axes, kMm * (up.to_ras * tool.position), stamp);
    constexpr std::size_t kNameLeft = 14;  // " force" has to fit into 20 bytes
    out += igtl_force(tool.station.substr(0, kNameLeft) + " force", up.to_ras * tool.force, stamp);
  }
  const std::size_t points = std::min(rest.size(), moment.shape.positions.size());
  const Eigen::Matrix3f to_mm = static_cast<float>(kMm) * up.to_ras.cast<float>();
  std::vector<Vec3f> places(points);
  std::vector<float> displacements(points);
  for (std::size_t k = 0; k < points; ++k) {
    places[k] = to_mm * moment.shape.positions[k];
    displacements[k] = static_cast<float>(kMm) * (moment.shape.positions[k] - rest[k]).norm();
  }
  return out + igtl_polydata("body", places, triangles, "displacement_mm", displacements, stamp);
}

std::string igtl_stl(const IgtlSurface& surface) {
  std::string out = "surface received over OpenIGTLink, in mm, RAS";
  out.resize(kStlTitleBytes, ' ');
  append_little(out, static_cast<std::uint32_t>(surface.triangles.size()));
  for (const Triangle& triangle : surface.triangles) {
    for (int none = 0; none < 3; ++none) append_little(out, 0.0F);  // readers compute the normal
    for (const std::uint32_t corner : triangle)
      for (const float coordinate : surface.points_mm[corner]) append_little(out, coordinate);
    append_little(out, std::uint16_t{0});
  }
  return out;
}

std::string igtl_scene(const IgtlSurface& surface, const ReceivedBody& body, const std::string& mesh_file) {
  Eigen::AlignedBox3d box;
  for (const Vec3f& point : surface.points_mm) box.extend(Vec3(body.up.to_ras.transpose() * point.cast<double>() / kMm));
  const double height = box.sizes().z(), held = body.held_m > 0 ? body.held_m : kHeldShare * height;
  if (box.sizes().minCoeff() < 2 * body.spacing_m)
    throw InputError("--spacing-mm",
                     std::to_string(kMm * body.spacing_m) + " is too coarse for a surface that is " +
                         std::to_string(kMm * box.sizes().minCoeff()) + " mm thin",
                     "at most half of that");
  if (held >= height)
    throw InputError("--hold-mm", "holds the whole surface, which is " + std::to_string(kMm * height) + " mm high", "less");
  nlohmann::ordered_json clip{{"file", mesh_file}, {"scale", 1 / kMm}};
  const Eigen::Vector3i& turn = body.up.rotation_deg;
  if (!turn.isZero()) clip["rotation_deg"] = {turn.x(), turn.y(), turn.z()};
  const double radius = body.radius_m > 0 ? body.radius_m : kTipSpacings * body.spacing_m;
  const nlohmann::ordered_json scene{{"name", body.name},
                                     {"body",
                                      {{"lattice",
                                        {{"spacing_m", body.spacing_m},
                                         {"clip", {{"mesh", clip}}},
                                         {"solid", {{"material", body.material}}},
                                         {"fixed_below_z_m", rounded_m(box.min().z() + held)}}}}},
                                     {"tool", {{"contact", "touch"}, {"radius_m", radius}}}};
  return scene.dump(2) + "\n";
}

}  // namespace palpate
