// A recording of a body of 20,000 triangles that is stroked at 30 Hz, in closed form, for `bench/view/reach.py --recording` and
// for measuring one's own frame rate. usage: fine_recording FILE.rec
#include <cstdio>
#include <fstream>

#include "common/record/writer.hpp"
#include "tests/client/view/demo_body.hpp"

using namespace palpate;

namespace {

constexpr int kEdge = 50;  // 8 kEdge^2 = 20,000 triangles
constexpr double kShapesHz = 30, kLengthS = 10;

/// An octahedron with each side cut into kEdge^2 triangles and projected to the unit sphere.
demo::Body fine_sphere() {
  demo::Body body;
  const demo::Body coarse = demo::unit_sphere(0);
  std::map<std::array<int, 3>, std::uint32_t> known;
  for (const Triangle& side : coarse.triangles) {
    const auto at = [&](int i, int j) {
      const Vec3f x = static_cast<float>(kEdge - i - j) * coarse.rest[side[0]] + static_cast<float>(i) * coarse.rest[side[1]] +
                      static_cast<float>(j) * coarse.rest[side[2]];
      const std::array<int, 3> key{static_cast<int>(x.x()), static_cast<int>(x.y()), static_cast<int>(x.z())};
      const auto [place, fresh] = known.try_emplace(key, static_cast<std::uint32_t>(body.rest.size()));
      if (fresh) body.rest.push_back(x.normalized());
      return place->second;
    };
    for (int i = 0; i < kEdge; ++i)
      for (int j = 0; i + j < kEdge; ++j) {
        body.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
        if (i + j + 1 < kEdge) body.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
  }
  return body;
}

/// Indents the body by a tool over (x, 0); everything yields a little.
void press(const demo::Body& body, float x, std::vector<Vec3>& positions, Vec3& tool) {
  const Vec3f at(x, 0, 0.04F * std::sqrt(1 - x * x / 0.0064F));
  positions.clear();
  for (const Vec3f& rest : body.rest) {
    const float r = (rest - at).norm();
    positions.push_back((rest - Vec3f(0, 0, 0.008F * std::exp(-r * r / 4e-4F) + 0.003F * std::exp(-r / 0.03F))).cast<double>());
  }
  tool = (at - Vec3f(0, 0, 0.011F)).cast<double>();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fputs("usage: fine_recording FILE.rec\n", stderr), 2;
  demo::Body body = fine_sphere();
  for (Vec3f& x : body.rest) x = x.cwiseProduct(Vec3f(0.08F, 0.055F, 0.04F));
  std::vector<Vec3> positions;
  for (const Vec3f& x : body.rest) positions.push_back(x.cast<double>());
  RecordingHead head;
  head.program = "test";
  head.name = "20,000 triangles";
  head.rate_hz = head.shapes_hz = kShapesHz;
  head.surface = recorded_surface(positions, body.triangles, 1);
  RecordingWriter writer(head);
  writer.add(RecordedEvent{{}, RecordedEventKind::joined, 1, RecordedRole::hand, Scheme::port, "hand", ""});
  for (int k = 0; k < kShapesHz * kLengthS; ++k) {
    RecordedTouch touch;
    touch.t = from_seconds(k / kShapesHz);
    touch.station = 1;
    touch.contact = true;
    touch.force = Vec3(0, 0, 1.5);
    press(body, 0.05F * std::sin(0.05F * static_cast<float>(k)), positions, touch.tool);
    writer.add(RecordedFrame{touch.t, Micros{5'000}, {}, 0, 1, 0, 0, false});
    writer.add(touch);
    writer.add_shape(touch.t, positions);
    writer.tick(touch.t);
  }
  writer.finish();
  const auto bytes = writer.take();
  std::ofstream file(argv[1], std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) return std::perror(argv[1]), 1;
  return 0;
}
