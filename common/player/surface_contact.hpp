// The piece of surface of a patch as the modes move it, and the contact of a sphere (of a point, with radius 0) on it, which the
// player closes every step (player.hpp):
//
//     vertex i    x_i = position_i + R_i q,          R = sum_k w_k R_(t_k) at a point w of triangle t
//     contact     the contact law between p_free = sum_k w_k x_(t_k) + b, where the point is without the contact's push, and
//                 c - rho n: c the sphere's centre, rho its radius, n the surface's normal at the point; C of port_push.hpp
//
// Where the law lets it slip the point moves along the surface, and is closed again there, kSlidesMax times at most. b: beyond
// the rim of the piece it continues on the plane there. A contact begins where the sphere comes through the surface (onset.hpp)
// and ends where it would pull.
//
// Shapes and units: q [m kg^1/2], r modes; R_i, R 3 x r [kg^-1/2]; x, p_free, b, c, rho [m].
#pragma once

#include <array>
#include <optional>

#include "common/patch/contact_law.hpp"
#include "common/patch/onset.hpp"
#include "common/patch/patch.hpp"
#include "common/player/port_push.hpp"
#include "common/player/slide_compliance.hpp"

namespace palpate {

class PlayedSurface {
 public:
  PlayedSurface() = default;
  /// At the stamp. `psi0`: that of a step.
  PlayedSurface(const PortSurface& surface, Eigen::Index modes, const StateInput& psi0);
  SurfaceView view() const noexcept;
  Positions positions() const noexcept { return {vertices_.data(), static_cast<std::size_t>(vertices_.size())}; }
  bool empty() const { return count_ == 0; }
  bool has_modes() const { return rows_.cols() > 0; }
  /// Moves all vertices with the modes.
  void place(const ModeVector& q) noexcept;
  Vec3 vertex(int i, const ModeVector& q) const;
  /// Sets R at a point, and Psi0 R^T.
  void respond(const SurfacePoint& point, PortRows& rows, PortPush& push) const noexcept;

 private:
  std::size_t count_ = 0;  // of triangles
  std::array<Triangle, kMaxPortTriangles> triangles_{};
  std::array<std::uint32_t, kMaxPortVertices + 1> first_{};
  std::array<std::uint32_t, 3 * kMaxPortTriangles> incident_{};
  std::array<std::uint8_t, kMaxPortTriangles> open_{};
  std::array<Vec3, kMaxPortVertices> lean_;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3 * kMaxPortVertices, 1> rest_, vertices_;  // at the stamp; as last placed
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 3 * kMaxPortVertices, kMaxModes> rows_;  // all R_i
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxStates, 3 * kMaxPortVertices>
      responses_;  // Psi0 R_i^T
};

class SurfaceContact {
 public:
  SurfaceContact() = default;
  SurfaceContact(const SurfacePoint& point, bool touching, const Mat3& c_static = Mat3::Zero())
      : touching_(touching), point_(point), c_static_(c_static) {}
  /// Adds to c_static what the modes of a linear patch lack where the tool slides to (slide_compliance.hpp).
  void compensate_slides(const Patch& patch, const PlayedSurface& surface);
  bool touching() const { return touching_; }
  /// Returns where the point is, with the surface as it was placed.
  Vec3 place(const PlayedSurface& surface) const noexcept;
  const Vec3& normal() const { return normal_; }
  /// Sets s, C and response of a push at the point.
  void respond(const PlayedSurface& surface, double contact_stiffness_n_m, PortPush& push) noexcept;
  /// Closes the contact at the end of a step, on the surface placed without its push there; sets `push`.
  void close(const PlayedSurface& surface, const Vec3& centre, double radius_m, const ContactParameters& parameters,
             PortPush& push) noexcept;
  /// The sphere's centre is `gap` away from the point without touching [m].
  void separate(const PlayedSurface& surface, const Vec3& gap) noexcept;
  /// Ends the contact, with the sphere's way from here on unknown.
  void leave() noexcept;

 private:
  bool touching_ = false;
  bool has_response_ = false;  // about the point; one that sticks keeps it
  SurfacePoint point_;
  Clearance clearance_;         // while not in contact
  Vec3 beyond_ = Vec3::Zero();  // b
  Vec3 normal_ = Vec3::Zero();  // of the last step with contact
  Mat3 c_static_ = Mat3::Zero();
  std::optional<SlideCompliance> slide_compliance_;
  Mat3 slid_ = Mat3::Zero();  // slide compliance since the contact began or since the stamp
};

}  // namespace palpate
