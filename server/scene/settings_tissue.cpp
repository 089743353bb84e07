// Settings of what holds tissue and what parts it: ligaments, clips, sutures, layers of tissue, cuts and tears.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/plain_text.hpp"
#include "server/scene/settings_fields.hpp"

namespace palpate {
namespace {

constexpr double kMinLigament = 1e-3, kMaxLigament = 1e6;  // [N/m], [N s/m]

}  // namespace

std::vector<TissueLayer> read_tissue(const SceneText& text, const schema::BodyT& in) {
  std::vector<TissueLayer> tissue;
  const std::string list = "body.tissue";
  if (in.tissue.size() > kMaxTissueLayers)
    text.refuse(list, fmt::format("the body has {} layers of tissue", in.tissue.size()),
                fmt::format("at most {}", kMaxTissueLayers));
  for (std::size_t i = 0; i < in.tissue.size(); ++i) {
    const schema::TissueLayerT& layer = *in.tissue[i];
    const std::string here = at(list, i);
    const bool innermost = i + 1 == in.tissue.size();
    if (innermost && layer.thickness_m)
      text.refuse(here + ".thickness_m", "the innermost layer has a thickness", "a thickness of the layers above it alone");
    text.in_range(here + ".puncture_n", layer.puncture_n, 0, 100, "N");
    text.in_range(here + ".friction_n_m", layer.friction_n_m, 0, 1e4, "N/m");
    tissue.push_back({innermost ? 0 : required(text, here + ".thickness_m", layer.thickness_m, 1e-4, 1, "m"),
                      required(text, here + ".toughness_j_m2", layer.toughness_j_m2, 1, 1e5, "J/m^2"), layer.puncture_n,
                      layer.friction_n_m});
  }
  return tissue;
}

std::vector<LigamentSettings> read_ligaments(const SceneText& text, const schema::BodyT& body, bool planar) {
  std::vector<LigamentSettings> out;
  constexpr double kMostM = 2 * kMaxCoordinateM;
  for (std::size_t i = 0; i < body.ligaments.size(); ++i) {
    const auto& in = *body.ligaments[i];
    const std::string path = at("body.ligaments", i);
    if (planar) text.refuse(path, path + " is given for a sheet", "a body in three dimensions for it");
    LigamentSettings ligament;
    ligament.from_m = vector(text, path + ".from_m", in.from_m, -kMaxCoordinateM, kMaxCoordinateM, "m");
    ligament.to_m = vector(text, path + ".to_m", in.to_m, -kMaxCoordinateM, kMaxCoordinateM, "m");
    ligament.radius_m = required(text, path + ".radius_m", in.radius_m, 0, kMostM, "m");
    ligament.stiffness_n_m = required(text, path + ".stiffness_n_m", in.stiffness_n_m, kMinLigament, kMaxLigament, "N/m");
    text.in_range(path + ".damping_n_s_m", in.damping_n_s_m, 0, kMaxLigament, "N s/m");
    ligament.damping_n_s_m = in.damping_n_s_m;
    out.push_back(ligament);
  }
  return out;
}

void read_cuts(const SceneText& text, const schema::BodyT& body, SceneSettings& out) {
  constexpr std::size_t kMostCuts = 64, kMostPlaces = 256;
  constexpr double kLeastAngle = 1e-3;  // between the path and the edge
  const std::string cuts = "body.cuts";
  if (body.cuts.size() > kMostCuts)
    text.refuse(cuts, cuts + " has " + std::to_string(body.cuts.size()) + " cuts", "at most " + std::to_string(kMostCuts));
  const std::optional<SolidSettings>& solid = out.mesh ? out.mesh->solid : out.lattice.solid;
  for (std::size_t i = 0; i < body.cuts.size(); ++i) {
    const auto& in = *body.cuts[i];
    const std::string path = at(cuts, i);
    if (!solid) text.refuse(path, path + " is given for springs", "a solid for it: finite elements");
    if (solid->capsule) text.refuse(path, path + " is given for a body with a capsule", "a body without one for it");
    if (in.path.size() < 2 || in.path.size() > kMostPlaces)
      text.refuse(path + ".path", path + ".path has " + std::to_string(in.path.size()) + " points",
                  "2 to " + std::to_string(kMostPlaces));
    CutSettings cut;
    cut.path_m = places(text, path + ".path", in.path);
    cut.direction = vector(text, path + ".direction", in.direction, -1e6, 1e6, "");
    if (!(cut.direction.norm() > 1e-9))
      text.refuse(path + ".direction", path + ".direction has no length", "a vector of any length");
    cut.direction.normalize();
    cut.depth_m = required(text, path + ".depth_m", in.depth_m, kMinSizeM, kMaxSizeM, "m");
    for (std::size_t k = 0; k + 1 < cut.path_m.size(); ++k) {
      const Vec3 along = cut.path_m[k + 1] - cut.path_m[k];
      if (!(along.cross(cut.direction).norm() > kLeastAngle * along.norm()))
        text.refuse(at(path + ".path", k + 1),
                    at(path + ".path", k + 1) + " lies along " + path + ".direction from the point before, or on it",
                    "a path across the direction");
    }
    out.cuts.push_back(std::move(cut));
  }
}

void read_tears(const SceneText& text, const schema::BodyT& body, SceneSettings& out) {
  const std::string tears = "body.tears";
  out.tears = body.tears;
  if (!out.tears) return;
  if (out.cuts.empty()) text.refuse(tears, "body.tears is given without body.cuts", "cuts, which tear on");
  if (out.tissue.size() != 1)
    text.refuse(tears, fmt::format("body.tears is given with {} layers of body.tissue", out.tissue.size()),
                "one layer, with its toughness");
  if (out.is_loaded)
    text.refuse(tears, "body.tears is given with a body.reference_configuration of \"loaded\"", "\"stress-free\"");
}

void read_clips(const SceneText& text, const schema::BodyT& body, SceneSettings& out) {
  constexpr std::size_t kMostClips = 64;
  const std::string clips = "body.clips";
  if (body.clips.size() > kMostClips)
    text.refuse(clips, fmt::format("{} has {} clips", clips, body.clips.size()), fmt::format("at most {}", kMostClips));
  for (std::size_t i = 0; i < body.clips.size(); ++i) {
    const schema::TissueClipT& in = *body.clips[i];
    const std::string path = at(clips, i);
    if (!out.mesh && !out.lattice.solid) text.refuse(path, path + " is given for springs", "a solid for it: finite elements");
    TissueClipSettings clip;
    clip.at_m = vector(text, path + ".at_m", in.at_m, -kMaxCoordinateM, kMaxCoordinateM, "m");
    clip.radius_m = required(text, path + ".radius_m", in.radius_m, kMinSizeM, kMaxSizeM, "m");
    clip.stiffness_n_m = required(text, path + ".stiffness_n_m", in.stiffness_n_m, kMinLigament, kMaxLigament, "N/m");
    text.in_range(path + ".damping_n_s_m", in.damping_n_s_m, 0, kMaxLigament, "N s/m");
    clip.damping_n_s_m = in.damping_n_s_m;
    out.clips.push_back(clip);
  }
}

void read_sutures(const SceneText& text, SceneSettings& out) {
  constexpr std::size_t kMostSutures = 16;
  const std::string list = "body.sutures", holds = "tool.holds";
  const schema::SceneT& in = text.values();
  const auto& sutures = in.body->sutures;
  const std::vector<std::string> named = in.tool ? in.tool->holds : std::vector<std::string>();
  if (sutures.size() > kMostSutures)
    text.refuse(list, fmt::format("{} has {} sutures", list, sutures.size()), fmt::format("at most {}", kMostSutures));
  if (!sutures.empty() && !out.mesh && !out.lattice.solid)
    text.refuse(list, list + " is given for springs", "a solid for it: finite elements");
  if (!sutures.empty() && out.is_loaded)
    text.refuse(list, list + " is given with a body.reference_configuration of \"loaded\"", "\"stress-free\"");
  if (!sutures.empty() && out.tears) text.refuse(list, list + " is given with body.tears", "one of them");
  if (!sutures.empty() && out.tool.needle && out.tool.needle->is_blade)
    text.refuse(list, list + " is given with a blade", "another tool");
  for (std::size_t i = 0; i < sutures.size(); ++i) {
    const schema::SutureT& from = *sutures[i];
    const std::string path = at(list, i);
    SutureSettings suture;
    if (!is_name(from.name)) text.refuse(path + ".name", std::string("1 to 64 bytes of ") + kNameCharacters);
    suture.name = from.name;
    for (const SutureSettings& other : out.sutures)
      if (other.name == from.name)
        text.refuse(path + ".name", path + ".name is \"" + from.name + "\", as that of a suture before", "a name of its own");
    const bool on_needle = out.tool.needle && std::ranges::count(named, from.name) > 0;
    const std::size_t fewest = on_needle ? 0 : 2, most = on_needle ? 0 : std::size_t{kMaxBites};
    if (from.bites.size() < fewest || from.bites.size() > most)
      text.refuse(path + ".bites", fmt::format("{}.bites has {} places", path, from.bites.size()),
                  on_needle ? "none, as the thread is on a needle" : fmt::format("2 to {}", kMaxBites));
    suture.bites_m = places(text, path + ".bites", from.bites);
    text.in_range(path + ".radius_m", from.radius_m, 1e-5, 0.01, "m");
    text.in_range(path + ".slack_m", from.slack_m, 0, kMaxThreadM, "m");
    text.in_range(path + ".first_tail_m", from.first_tail_m, 0, kMaxThreadM, "m");
    text.in_range(path + ".tail_m", from.tail_m, 0, kMaxThreadM, "m");
    text.in_range(path + ".stiffness_n_m", from.stiffness_n_m, kMinThreadStiffness_n_m, kMaxThreadStiffness_n_m, "N/m");
    text.in_range(path + ".mu", from.mu, 0, 2, "");
    text.in_range(path + ".drag_n", from.drag_n, 0, 10, "N");
    suture.radius_m = from.radius_m;
    suture.slack_m = from.slack_m;
    suture.first_tail_m = from.first_tail_m;
    suture.tail_m = from.tail_m;
    const std::size_t tied = choice(text, path + ".tied", from.tied, kTiedNames, 0);
    suture.first_tied = tied == 0 || tied == 2;
    suture.last_tied = tied == 1 || tied == 2;
    suture.barbed = from.barbed;
    suture.stiffness_n_m = from.stiffness_n_m;
    suture.friction = from.mu;
    suture.drag_n = from.drag_n;
    out.sutures.push_back(std::move(suture));
  }
  if (!sutures.empty() && out.tissue.size() > 1)
    text.refuse(list, fmt::format("{} is given with {} layers of body.tissue", list, out.tissue.size()),
                "one layer, with its toughness, or none");
  if (!text.has(holds)) return;
  if (out.tool.contact == ContactKind::attach) text.refuse(holds, holds + " is given for a grasp", "a tool.contact of \"touch\"");
  for (std::size_t i = 0; i < named.size(); ++i) {
    const std::string& name = named[i];
    const std::string path = at(holds, i);
    const auto held = std::ranges::find_if(out.sutures, [&](const SutureSettings& suture) { return suture.name == name; });
    if (held == out.sutures.end()) text.refuse(path, "the name of one of body.sutures");
    if (held->last_tied) text.refuse(path, path + " is a suture that is tied at its last bite", "one whose end can be pulled");
    const auto number = static_cast<std::uint32_t>(held - out.sutures.begin());
    if (std::ranges::count(out.tool.holds, number) > 0) text.refuse(path, path + " is named twice", "each suture once");
    out.tool.holds.push_back(number);
  }
}

}  // namespace palpate
