#include "bench/lab/tasks.hpp"

#include <fmt/format.h>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/measure/examination.hpp"
#include "server/body/unload.hpp"

namespace palpate {

std::string at_place(const std::string& scene, int place) { return place == 0 ? scene : fmt::format("{}@{}", scene, place); }

void add_examination(SweepTasks& tasks, const std::filesystem::path& scenes, const std::string& name) {
  if (tasks.contains(name)) return;
  const auto at = name.rfind('@');
  const int place = at == std::string::npos ? 0 : std::stoi(name.substr(at + 1));
  Scene body = open_scene((scenes / (name.substr(0, at) + ".json")).string());
  Motion motion = place == 0 ? examination(body) : examination(body, drawn_places(body, place).back());
  tasks.emplace(name, SweepTask{std::move(body), std::move(motion), {}});
}

void add_references(SweepTasks& tasks, unsigned jobs) {
  std::vector<SweepTask*> list;
  for (auto& [name, task] : tasks) list.push_back(&task);
  run_all(
      list.size(), [&](std::size_t i) { list[i]->reference = reference_of(list[i]->scene, list[i]->motion); }, jobs,
      "the references");
}

}  // namespace palpate
