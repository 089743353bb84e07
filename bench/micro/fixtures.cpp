#include "bench/micro/fixtures.hpp"

#include <algorithm>
#include <stdexcept>

#include "bench/micro/timer.hpp"
#include "server/body/unload.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/scene_text.hpp"

namespace palpate {
namespace {

constexpr StationId kStation = 1;
std::filesystem::path scene_folder = "scenes";

}  // namespace

void set_scene_folder(const std::filesystem::path& folder) { scene_folder = folder; }

Scene scene_of(const std::string& name) { return open_scene(scene_folder / (name + ".json")); }
Motion motion_of(const std::string& name) { return read_motion(scene_folder / "motions" / (name + ".csv")); }

Scene cube_of(int n) {
  const SceneText text(scene_folder / "cube6.json");
  SceneSettings settings = read_settings(text);
  const double finer = (settings.lattice.nodes[0] - 1.0) / (n - 1.0);
  settings.lattice.nodes = {n, n, n};
  settings.lattice.stiffness_n_m *= finer;
  settings.lattice.damping_n_s_m *= finer;
  Scene scene;
  scene.name = "cube" + std::to_string(n);
  scene.body = build_lattice(settings.lattice, text).body;
  scene.tool.contact = ContactKind::touch;
  return scene;
}

Scene solid_cube_of(int n, double damping_s) {
  const SceneText text(scene_folder / "cube6.json");
  SceneSettings settings = read_settings(text);
  settings.lattice.nodes = {n, n, n};
  settings.lattice.density_kg_m3 = 1060;
  settings.lattice.solid = SolidSettings{.material = {SolidLaw::neo_hookean, 5500, 0.45, damping_s}};
  Scene scene;
  scene.name = "hexahedra" + std::to_string(n);
  scene.body = build_lattice(settings.lattice, text).body;
  scene.tool.contact = ContactKind::touch;
  return scene;
}

Scene blade_of(double spacing_m) {
  const SceneText text(scene_folder / "cuts" / "blade.json");
  SceneSettings settings = read_settings(text);
  settings.lattice.spacing_m = spacing_m;
  Scene scene;
  scene.name = settings.name;
  scene.tool = settings.tool;
  scene.body = build_lattice(settings.lattice, text).body;
  scene.body.tissue = settings.tissue;
  return scene;
}

Motion above(const Scene& scene, const Motion& motion, double height_m) {
  Scene touched = scene;
  touched.tool.contact = ContactKind::touch;
  Vec3 top = home_of(touched);
  top.z() = 0;
  for (const Vec3& x : scene.body.nodes) top.z() = std::max(top.z(), x.z());
  const Vec3 shift = top + Vec3(0, 0, height_m) - motion.points().front().position;
  std::vector<MotionPoint> points(motion.points().begin(), motion.points().end());
  for (MotionPoint& p : points) p.position += shift;
  return Motion(std::move(points));
}

FrameDriver::FrameDriver(const Scene& scene, const Motion& motion, Scheme scheme) : room_(scene), motion_(motion) {
  room_.start(Micros{0});
  StationJob station;
  station.id = kStation;
  station.scheme = scheme;
  station.horizon = kHorizon;
  station.samples.push_back({Micros{0}, motion_.position(0.0)});
  job_.stations.push_back(station);
}

FrameResult FrameDriver::next() {
  StationJob& station = job_.stations[0];
  for (Micros t = job_.target + Micros{1000}; t <= job_.target + kFrame; t += Micros{1000})
    station.samples.push_back({t, motion_.position(t)});
  job_.target += kFrame;
  const Timer simulating;
  FrameResult result = room_.simulate(job_);
  simulate_ms_ = simulating.seconds() * 1e3;
  const Timer building;
  room_.build_patches(job_, result);
  build_ms_ = building.seconds() * 1e3;
  station.samples.clear();
  return result;
}

Patch patch_after(const Scene& scene, const Motion& motion, double seconds) {
  FrameDriver driver(scene, motion, Scheme::port);
  std::optional<Patch> patch;
  for (double t = 0; t < seconds; t += palpate::seconds(FrameDriver::kFrame)) patch = driver.next().stations[0].patch;
  if (!patch) throw std::runtime_error("scene " + scene.name + ": no patch after " + std::to_string(seconds) + " s");
  return *patch;
}

Patch grasp_patch() { return patch_after(scene_of("cube6"), motion_of("base-excursion"), 1.0); }

Patch touch_patch() {
  const Scene scene = scene_of("touch-cube");
  return patch_after(scene, above(scene, motion_of("press"), 0.001), 1.0);
}

Patch eight_touch_patch() {
  constexpr double kApartM = 0.006, kRadiusM = 0.004, kBow_1_m = 10;
  Scene scene = scene_of("touch-cube");
  for (int k = 0; k < static_cast<int>(kMaxToolSpheres); ++k) {
    const double x = kApartM * (k % 4 - 1.5), y = kApartM * (k / 4 - 0.5);
    scene.tool.shape.push_back({.centre = {x, y, kRadiusM + kBow_1_m * (x * x + y * y)}, .radius_m = kRadiusM});
  }
  const Patch patch = patch_after(scene, above(scene, motion_of("press"), 0.001), 1.0);
  if (!patch.touching || std::ranges::any_of(patch.others.tools(), [](const OtherContact& o) { return !o.touching; }))
    throw std::runtime_error("not all of the eight spheres touch");
  return patch;
}

}  // namespace palpate
