// Threads of a body as viewers draw them: tubes around their first tail, their bites and the spans between them, and their tail
// up to the hand. Their vertices have the numbers after those of the body, in the mesh, in shapes and in recordings.
//
// A span is drawn from bite to bite over the surface above them, as it is at rest: so it is seen when it has closed a wound.
// Where a needle drew it through the tissue it is drawn inside until it is tied.
//
// In the middle of each span two rings are in one place, with nothing between them: where a span is cut, its two stubs hang from
// their bites. A bite that was torn out, or that a needle has yet to take, is drawn where the one before it is. A thread on a
// needle hangs from its end.
#pragma once

#include <optional>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/room/thread_chain.hpp"

namespace palpate {

/// The surface of a body at rest, without the walls of cuts.
class OuterSurface {
 public:
  explicit OuterSurface(const LumpedBody& body);
  /// Returns the way from a point in the body to where a thread of this radius lies on the surface.
  Vec3 above(const Vec3& point, double radius_m) const;

 private:
  std::vector<Vec3> x_;
  Surface surface_;
};

class DrawnThreads {
 public:
  /// `body` must outlive it. Tails begin straight: the first upwards, the other aside.
  explicit DrawnThreads(const LumpedBody& body);
  bool empty() const { return threads_.empty(); }
  /// Moves tails and stubs on to the time of a state.
  void advance(const Dynamics& dynamics, const BodyState& state, const std::optional<ThreadOnNeedle>& on_needle = {});
  /// Appends the positions of the tubes' vertices.
  void append(std::vector<Vec3>& positions) const;
  std::size_t vertices() const;
  /// Triangles of the tubes, closed at the ends of a thread, over the vertices from `first` on.
  std::vector<Triangle> triangles(std::uint32_t first) const;

 private:
  struct Span {
    ThreadChain low, high;                                                   ///< from the bite before, and from that behind
    Vec3 rest_low = Vec3::Zero(), rest_high = Vec3::Zero();                  ///< the bites at rest
    Vec3 over_low = rest_low, over_middle = rest_low, over_high = rest_low;  ///< from them and their middle to the surface
    void lie_over(const OuterSurface& surface, const Vec3& low_rest, const Vec3& high_rest, double radius_m);
  };
  struct Thread {
    ThreadChain first, tail;  ///< from the first bite, and from the last
    std::vector<Span> spans;
    bool has_bites = true;
    void hang_from(const Vec3& at);
    std::size_t points() const;
    /// Its points in turn; the last of each piece between two gaps.
    std::vector<Vec3> line(std::vector<std::size_t>& ends) const;
  };
  const LumpedBody* body_;
  std::optional<OuterSurface> surface_;
  std::vector<Thread> threads_;
  double time_s_ = 0;
};

}  // namespace palpate
