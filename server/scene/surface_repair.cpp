#include "server/scene/surface_repair.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "server/scene/surface.hpp"

namespace palpate {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// Triangles of every directed edge.
using EdgeUses = std::multimap<Edge, std::uint32_t>;

EdgeUses uses_of_edges(std::span<const Triangle> triangles) {
  std::vector<std::pair<Edge, std::uint32_t>> uses;
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) uses.push_back({{triangles[t][i], triangles[t][(i + 1) % 3]}, t});
  std::sort(uses.begin(), uses.end());
  return {uses.begin(), uses.end()};
}

/// Drops all but the first of triangles over the same corners with the same orientation.
std::size_t drop_doubled(std::vector<Triangle>& triangles) {
  std::set<Triangle> seen;
  return std::erase_if(triangles, [&](Triangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return !seen.insert(t).second;
  });
}

/// Drops pairs of triangles over the same corners that face each other, as where two solids touch: they bound nothing. Of a
/// surface of such pairs alone, one of each stays.
std::size_t drop_walls(std::vector<Triangle>& triangles) {
  const auto corners = [](Triangle t) { return std::sort(t.begin(), t.end()), t; };
  std::map<Triangle, std::size_t> there;
  for (const Triangle& t : triangles) ++there[corners(t)];
  const bool all = std::ranges::all_of(there, [](const auto& t) { return t.second > 1; });
  return std::erase_if(triangles, [&](const Triangle& t) {
    std::size_t& left = there[corners(t)];
    return left == 2 && (!all || left-- == 2);
  });
}

/// Open edges in the order of the loop that a polygon in the hole would have, starting at `first`; empty if they form no simple
/// loop.
std::vector<std::uint32_t> loop_from(const std::map<std::uint32_t, std::uint32_t>& next, std::uint32_t first) {
  std::vector<std::uint32_t> loop{first};
  for (auto at = next.find(first); at != next.end() && loop.size() <= kMaxCorners; at = next.find(at->second)) {
    if (at->second == first) return loop;
    loop.push_back(at->second);
  }
  return {};
}

double length_of(const std::vector<std::uint32_t>& loop, std::span<const Vec3> x) {
  double length = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) length += (x[loop[(i + 1) % loop.size()]] - x[loop[i]]).norm();
  return length;
}

double size_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.vertices) box.extend(x);
  return box.diagonal().norm();
}

/// Requires triangles of consistent orientation.
std::size_t close_holes(TriangleMesh& mesh) {
  const EdgeUses uses = uses_of_edges(mesh.triangles);
  std::map<std::uint32_t, std::uint32_t> next;  // along the edges of the hole's missing triangles
  std::set<std::uint32_t> forks;
  for (const auto& [edge, triangle] : uses) {
    if (uses.contains({edge.second, edge.first})) continue;
    if (!next.try_emplace(edge.second, edge.first).second) forks.insert(edge.second);
  }
  for (const std::uint32_t vertex : forks) next.erase(vertex);
  const double longest = kMostHole * size_of(mesh);
  std::size_t holes = 0;
  while (!next.empty()) {
    const std::vector<std::uint32_t> loop = loop_from(next, next.begin()->first);
    if (loop.size() >= 3 && length_of(loop, mesh.vertices) <= longest) {
      cut_polygon(loop, mesh.vertices, mesh.triangles);
      ++holes;
    }
    for (const std::uint32_t vertex : loop) next.erase(vertex);
    if (loop.empty()) next.erase(next.begin());
  }
  return holes;
}

/// Shells: sets of triangles connected by edges of two triangles.
class Shells {
 public:
  explicit Shells(std::vector<Triangle>& triangles) : triangles_(triangles), shell_(triangles.size(), kNoNode) {
    const EdgeUses uses = uses_of_edges(triangles);
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
      if (shell_[t] == kNoNode) spread(t, uses);
  }

  std::size_t count() const { return count_; }
  std::size_t turned() const { return turned_; }
  std::vector<std::vector<Triangle>> parts() const {
    std::vector<std::vector<Triangle>> out(count_);
    for (std::size_t t = 0; t < triangles_.size(); ++t) out[shell_[t]].push_back(triangles_[t]);
    return out;
  }
  void turn_shell(std::size_t shell) {
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (shell_[t] == shell) std::swap(triangles_[t][1], triangles_[t][2]);
  }

 private:
  /// Visits all triangles connected to `first`; the minority orientation is reversed.
  void spread(std::uint32_t first, const EdgeUses& uses) {
    const auto shell = static_cast<std::uint32_t>(count_++);
    std::vector<std::pair<std::uint32_t, bool>> found{{first, false}};  // true: it faces against the first
    shell_[first] = shell;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Triangle t = triangles_[found[i].first];
      for (std::size_t k = 0; k < 3; ++k) {
        const Edge along{t[k], t[(k + 1) % 3]}, back{along.second, along.first};
        if (uses.count(along) + uses.count(back) != 2) continue;
        for (const Edge& edge : {along, back})
          for (auto [use, end] = uses.equal_range(edge); use != end; ++use)
            if (shell_[use->second] == kNoNode) {
              shell_[use->second] = shell;
              found.emplace_back(use->second, found[i].second != (edge == along));
            }
      }
    }
    const auto against = static_cast<std::size_t>(std::ranges::count_if(found, [](const auto& t) { return t.second; }));
    const bool turn_those = 2 * against <= found.size();
    turned_ += std::min(against, found.size() - against);
    for (const auto& [t, faces_against] : found)
      if (faces_against == turn_those) std::swap(triangles_[t][1], triangles_[t][2]);
  }

  std::vector<Triangle>& triangles_;
  std::vector<std::uint32_t> shell_;
  std::size_t count_ = 0, turned_ = 0;
};

/// A shell by itself.
struct Shell {
  TriangleTree tree;
  double volume;
  Vec3 corner;  ///< one of its vertices

  Shell(const TriangleMesh& mesh, const std::vector<Triangle>& triangles)
      : tree({mesh.vertices, triangles}),
        volume(signed_volume(triangles, mesh.vertices)),
        corner(mesh.vertices[triangles.front()[0]]) {}
  bool holds(const Shell& other) const {
    return std::abs(volume) > std::abs(other.volume) && tree.bounds().contains(other.tree.bounds()) &&
           std::abs(tree.winding_number(other.corner)) > 0.5;
  }
};

/// Reverses shells that are inside out and lie in no other.
std::size_t turn_shells(const TriangleMesh& mesh, Shells& shells) {
  std::vector<Shell> all;
  for (const std::vector<Triangle>& triangles : shells.parts()) all.emplace_back(mesh, triangles);
  std::size_t turned = 0;
  for (std::size_t s = 0; s < all.size(); ++s) {
    if (!(all[s].volume < 0) || std::ranges::any_of(all, [&](const Shell& other) { return other.holds(all[s]); })) continue;
    shells.turn_shell(s);
    ++turned;
  }
  return turned;
}

void add_words(std::string& to, std::size_t n, const char* one, const char* many) {
  if (n > 0) to += (to.empty() ? "" : ", ") + std::to_string(n) + (n == 1 ? one : many);
}

}  // namespace

SurfaceRepairs repair_surface(TriangleMesh& mesh) {
  SurfaceRepairs repairs;
  repairs.doubled = drop_doubled(mesh.triangles);
  repairs.walls = drop_walls(mesh.triangles);
  repairs.turned = Shells(mesh.triangles).turned();
  repairs.holes = close_holes(mesh);
  repairs.walls += drop_walls(mesh.triangles);  // of a loose triangle, too
  Shells shells(mesh.triangles);
  repairs.shells = shells.count();
  if (shells.count() <= kMostShells) repairs.turned_shells = turn_shells(mesh, shells);
  return repairs;
}

std::size_t drop_inner_shells(TriangleMesh& mesh) {
  const std::vector<std::vector<Triangle>> parts = Shells(mesh.triangles).parts();
  std::vector<Shell> all;
  for (const std::vector<Triangle>& triangles : parts) all.emplace_back(mesh, triangles);
  const auto side = [](const Shell& shell) { return shell.volume < 0 ? -1 : 1; };
  mesh.triangles.clear();
  std::size_t dropped = 0;
  for (std::size_t s = 0; s < all.size(); ++s) {
    int outside = 0;
    for (const Shell& other : all) outside += other.holds(all[s]) ? side(other) : 0;
    if ((outside == 0) == (outside + side(all[s]) == 0))
      ++dropped;
    else
      mesh.triangles.insert(mesh.triangles.end(), parts[s].begin(), parts[s].end());
  }
  return dropped;
}

std::string SurfaceRepairs::in_words() const {
  std::string words;
  add_words(words, doubled, " triangle that was there twice left out", " triangles that were there twice left out");
  add_words(words, walls, "", " triangles that face each other in one place left out");
  add_words(words, turned, " triangle that faced the wrong way turned", " triangles that faced the wrong way turned");
  add_words(words, holes, " small hole closed", " small holes closed");
  if (turned_shells > 0 && turned_shells == shells) return words + (words.empty() ? "" : ", ") + "is inside out; turned";
  add_words(words, turned_shells, " shell that was inside out turned", " shells that were inside out turned");
  return words;
}

}  // namespace palpate
