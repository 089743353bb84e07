// Between a scene and a patient: frame W (z up) and RAS, the surface of a moment as messages, and a received surface as a scene.
#pragma once

#include <string>
#include <string_view>

#include "client/igtl/igtl_messages.hpp"
#include "client/viewer/view_core.hpp"

namespace palpate {

/// Patient's direction that is up in the scene.
struct PatientUp {
  std::string name = "superior";                           ///< also inferior, anterior, posterior, right, left
  Eigen::Vector3i rotation_deg = Eigen::Vector3i::Zero();  ///< of RAS into W: about x, then y, then z, as in scenes
  Mat3 to_ras = Mat3::Identity();                          ///< of W into RAS
};
inline constexpr const char* kPatientUps = "superior, inferior, anterior, posterior, right or left";
/// Throws InputError for another name.
PatientUp patient_up(std::string_view name);

/// Returns the messages of a moment, one after the other: for each hand TRANSFORM "NAME" and SENSOR "NAME force"; POLYDATA "body"
/// with the displacement from rest of each point [mm]. p_RAS = 1000 R p_W, where R = up.to_ras. A hand without orientation has
/// RAS's axes.
std::string igtl_moment(const ViewMoment& moment, std::span<const Triangle> triangles, std::span<const Vec3f> rest,
                        const PatientUp& up, std::uint64_t stamp);

/// Body made from a received surface.
struct ReceivedBody {
  std::string name, material;
  double spacing_m = 0.008;
  double held_m = 0;    ///< height above its lowest point up to which it is held; 0: 15 % of its height
  double radius_m = 0;  ///< contact radius of the tip; 0: twice the spacing
  PatientUp up;
};
/// Returns the surface as a binary STL, in the patient's frame and millimetres.
std::string igtl_stl(const IgtlSurface& surface);
/// Returns a scene in which that file, `mesh_file`, becomes a body of hexahedra at its place in the patient. Throws InputError
/// for a spacing of which no node fits.
std::string igtl_scene(const IgtlSurface& surface, const ReceivedBody& body, const std::string& mesh_file);

}  // namespace palpate
