// Threads of a body as viewers draw them: tubes around their first tail, their bites and the spans between them, and their tail
// up to the hand. Their vertices have the numbers after those of the body, in the mesh, in shapes and in recordings.
//
// A span is drawn from bite to bite over the surface above them, as it is at rest: so it is seen when it has closed a wound.
//
// In the middle of each span two rings are in one place, with nothing between them: where a span is cut, its two stubs hang from
// their bites. A bite that was torn out is drawn where the one before it is.
#pragma once

#include <vector>

#include "server/body/dynamics.hpp"
#include "server/room/thread_chain.hpp"

namespace palpate {

class DrawnThreads {
 public:
  /// `body` must outlive it. Tails begin straight: the first upwards, the other aside.
  explicit DrawnThreads(const LumpedBody& body);
  bool empty() const { return threads_.empty(); }
  /// Moves tails and stubs on to the time of a state.
  void advance(const Dynamics& dynamics, const BodyState& state);
  /// Appends the positions of the tubes' vertices.
  void append(std::vector<Vec3>& positions) const;
  std::size_t vertices() const;
  /// Triangles of the tubes, closed at the ends of a thread, over the vertices from `first` on.
  std::vector<Triangle> triangles(std::uint32_t first) const;

 private:
  struct Span {
    ThreadChain low, high;                  ///< from the bite before, and from that behind
    Vec3 over_low, over_middle, over_high;  ///< from the bites, and from their middle, to the surface
    bool cut = false;
  };
  struct Thread {
    ThreadChain first, tail;  ///< from the first bite, and from the last
    std::vector<Span> spans;
    std::size_t points() const;
    /// Its points in turn; the last of each piece between two gaps.
    std::vector<Vec3> line(std::vector<std::size_t>& ends) const;
  };
  const LumpedBody* body_;
  std::vector<Thread> threads_;
  double time_s_ = 0;
};

}  // namespace palpate
