// Prints messages of palpate-web as bytes, beside what they were made of, for check_protocol.mjs.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "client/web/web_frames.hpp"
#include "tests/client/view/demo_body.hpp"

using namespace palpate;
using nlohmann::json;

namespace {

json bytes_of(const std::string& frame) {
  json bytes = json::array();
  for (const char c : frame) bytes.push_back(static_cast<unsigned char>(c));
  return bytes;
}

template <class Points>
json numbers_of(const Points& points) {
  json numbers = json::array();
  for (const auto& p : points)
    for (const auto x : p) numbers.push_back(x);
  return numbers;
}

}  // namespace

int main() {
  demo::Body body = demo::pressed_organ(0.012F, 2.5, 3);
  body.tools[0].station = "or 3 \xc3\xa4";
  body.tools[0].buttons = 0x80000001u;
  body.tools[0].orientation = Eigen::Quaterniond(0.1, 0.7, -0.5, 0.5).normalized();
  body.tools[0].torque = Vec3(0.02, -0.01, 0.005);
  body.tools.push_back({"free", Vec3(0.01, 0.02, 0.1), Vec3::Zero(), false});
  const RoomInfo facts = demo::facts_of(body);
  const float unit_m = shape_unit_m(body.triangles, body.rest);
  ViewMoment moment;
  moment.shape.positions = body.positions;
  moment.shape.body_time = Micros{1'700'000'012'345'678};
  moment.tools = body.tools;
  json tools = json::array(), marks = json::array();
  for (const ToolView& tool : body.tools) {
    json j{{"station", tool.station},
           {"contact", tool.contact},
           {"buttons", tool.buttons},
           {"position", numbers_of(std::array{tool.position})},
           {"force", numbers_of(std::array{tool.force})},
           {"orientation", nullptr}};
    j["torque"] = tool.torque.isZero(0) ? json(nullptr) : json(numbers_of(std::array{tool.torque}));
    if (tool.orientation) j["orientation"] = numbers_of(std::array{Eigen::Vector4d(tool.orientation->coeffs())});
    tools.push_back(std::move(j));
  }
  for (const MeshVertex& vertex : facts.mesh.vertices) marks.push_back(mark_of(vertex));
  const std::vector<PartMesh> rigid{
      {"R\xc3\xb6hre", 0xff8000, 0.25, {{{Vec3(0.5, 0, 1)}, {Vec3(0, 0.25, 0)}, {Vec3(0, 0, -1)}}, {{0, 2, 1}}}}};
  json parts = json::array();
  for (const PartMesh& part : rigid) {
    json vertices = json::array();
    for (const MeshVertex& vertex : part.mesh.vertices)
      for (const double x : vertex.rest) vertices.push_back(x);
    parts.push_back(
        {{"name", part.name}, {"color", part.colour}, {"vertices", vertices}, {"triangles", numbers_of(part.mesh.triangles)}});
  }
  const json all{{"mesh", bytes_of(mesh_frame(facts.mesh, body.rest, 7, unit_m))},
                 {"parts_frame", bytes_of(parts_frame(rigid))},
                 {"parts", parts},
                 {"shape", bytes_of(shape_frame(moment, body.rest, 7, unit_m))},
                 {"unit", unit_m},
                 {"t", seconds(moment.shape.body_time)},
                 {"rest", numbers_of(body.rest)},
                 {"positions", numbers_of(body.positions)},
                 {"triangles", numbers_of(body.triangles)},
                 {"marks", marks},
                 {"tools", tools}};
  return std::puts(all.dump().c_str()) < 0 ? 1 : 0;
}
